import {useEffect, useState} from 'preact/hooks';
import {useAsk, useKeys, useLive} from '../model/hooks';
import {at, textOf} from '../model/scene_yaml';
import type {SceneState, SourceState} from '../model/types';
import {GroupForm} from '../parts/form';
import {Kept} from '../parts/kept';
import {Said} from '../parts/said';

interface FileEntry {
  name: string;
  file: string;
  kind: 'folder' | 'run' | 'video' | 'scene' | 'yaml' | 'calibration';
}

const kThumbnails = new Set(['video']);

/** What of a recording has been chosen so far. */
interface Choice {
  left: string;
  right: string;
  stereo: string;
  calibration: string;
}
const kNothing: Choice = {left: '', right: '', stereo: '', calibration: ''};

/** Both cameras and the calibration, where their names tell. */
function guess(files: FileEntry[]): Choice {
  const video = (part: string) => files.find((f) => f.kind === 'video' && f.name.toLowerCase().includes(part))?.file ?? '';
  const calibration = files.find((f) => ['yaml', 'calibration'].includes(f.kind) && /calib|camera|stereo|left/i.test(f.name));
  return {left: video('left'), right: video('right'), stereo: '', calibration: calibration?.file ?? ''};
}

function Browser() {
  const [folder, setFolder] = useState('');
  const [files, setFiles] = useState<FileEntry[]>([]);
  const [choice, setChoice] = useState<Choice>(kNothing);
  const [ask, sentence, forget] = useAsk();
  const [isBusy, setIsBusy] = useState(false);
  useEffect(() => {
    fetch(`/api/files?folder=${encodeURIComponent(folder)}`)
      .then((answer) => (answer.ok ? answer.json() : {files: []}))
      .then(({files: found}: {files: FileEntry[]}) => {
        setFiles(found);
        setChoice(guess(found));
      })
      .catch(() => setFiles([]));
  }, [folder]);
  const open = async (what: string, fields: object) => {
    setIsBusy(true);
    if (await ask(what, fields)) location.hash = '#scene';
    setIsBusy(false);
  };
  const options = (kinds: string[]) => [
    <option key="" value="">–</option>,
    ...files.filter((f) => kinds.includes(f.kind)).map((f) => <option key={f.file} value={f.file}>{f.name}</option>),
  ];
  const select = (name: keyof Choice, kinds: string[]) => (
    <label>
      {name}
      <select value={choice[name]} onChange={(e) => setChoice({...choice, [name]: e.currentTarget.value})}>{options(kinds)}</select>
    </label>
  );
  const mayOpenLive = useLive().mayOpenLive;
  const isWhole = !!choice.calibration && (choice.stereo ? true : !!choice.left && !!choice.right);
  const steps = folder ? folder.split('/') : [];
  return (
    <section class="browser">
      <h2>Open</h2>
      <nav class="crumbs" aria-label="folder">
        <button class="link" onClick={() => setFolder('')}>root</button>
        {steps.map((step, i) => (
          <button key={i} class="link" onClick={() => setFolder(steps.slice(0, i + 1).join('/'))}>/ {step}</button>
        ))}
      </nav>
      <Said sentence={sentence} forget={forget} />
      <ul class="files">
        {files.map((f) => (
          <li key={f.file} class={`kind-${f.kind}`}>
            {f.kind === 'folder' || f.kind === 'run' ? (
              <button onClick={() => setFolder(f.file)}><span class="icon" aria-hidden="true">▸</span>{f.name}{f.kind === 'run' && <small>finished run</small>}</button>
            ) : f.kind === 'scene' ? (
              <button disabled={isBusy} onClick={() => void open('open_scene', {file: f.file})}><strong>{f.name}</strong><small>open this scene</small></button>
            ) : (
              <span class="file">
                {kThumbnails.has(f.kind) && <img loading="lazy" width="120" height="68" alt="" src={`/api/thumbnail?file=${encodeURIComponent(f.file)}`} />}
                {f.name}
              </span>
            )}
          </li>
        ))}
        {!files.length && <li class="hint">nothing here that could be opened</li>}
      </ul>
      <fieldset class="choice">
        <legend>or a recording without a scene</legend>
        {select('left', ['video'])}
        {select('right', ['video'])}
        {select('stereo', ['video'])}
        {select('calibration', ['yaml', 'calibration'])}
        <button class="primary" disabled={!isWhole || isBusy} onClick={() => void open('open_recording', choice.stereo ? {...choice, left: '', right: ''} : choice)}>Open recording</button>
      </fieldset>
      <LiveForm mayOpen={mayOpenLive} isBusy={isBusy} calibration={choice.calibration} selectCalibration={select('calibration', ['yaml', 'calibration'])} open={(fields) => void open('open_recording', fields)} />
    </section>
  );
}

interface LiveFormProps {
  mayOpen: boolean;
  isBusy: boolean;
  calibration: string;
  selectCalibration: preact.JSX.Element;
  open: (fields: object) => void;
}

/** Cameras by device, address or GStreamer pipeline. */
function LiveForm({mayOpen, isBusy, calibration, selectCalibration, open}: LiveFormProps) {
  const [names, setNames] = useState({left: '', right: '', stereo: ''});
  const field = (name: keyof typeof names, example: string) => (
    <label>
      {name}
      <input aria-label={`live ${name}`} disabled={!mayOpen} placeholder={example} spellcheck={false} value={names[name]} onInput={(e) => setNames({...names, [name]: e.currentTarget.value})} />
    </label>
  );
  const isWhole = !!calibration && (names.stereo ? true : !!names.left && !!names.right);
  return (
    <fieldset class="choice">
      <legend>or a live source</legend>
      {field('left', 'decklinkvideosrc device-number=0 ! deinterlace')}
      {field('right', 'rtsp://192.168.1.20/right')}
      {field('stereo', '0 (both side by side)')}
      {selectCalibration}
      <button class="primary" disabled={!mayOpen || !isWhole || isBusy} onClick={() => open({...(names.stereo ? {...names, left: '', right: ''} : names), calibration})}>Open live source</button>
      {!mayOpen && <p class="hint">A pipeline can read and write anything on this computer, so the program has to be started with <code>--live</code> for it.</p>}
    </fieldset>
  );
}

/** Rows that must meet the same points in both cameras; they can be dragged. */
function RowLines({count}: {count: number}) {
  const [rows, setRows] = useState(() => Array.from({length: count}, (_, i) => (i + 1) / (count + 1)));
  const drag = (index: number) => (event: PointerEvent) => {
    const box = (event.currentTarget as Element).closest('svg')!.getBoundingClientRect();
    const move = (next: PointerEvent) => {
      const at = Math.min(1, Math.max(0, (next.clientY - box.top) / box.height));
      setRows((now) => now.map((row, i) => (i === index ? at : row)));
    };
    const up = () => {
      removeEventListener('pointermove', move);
      removeEventListener('pointerup', up);
    };
    addEventListener('pointermove', move);
    addEventListener('pointerup', up);
  };
  const nudge = (index: number) => (event: KeyboardEvent) => {
    const by = event.key === 'ArrowUp' ? -0.005 : event.key === 'ArrowDown' ? 0.005 : 0;
    if (!by) return;
    event.preventDefault();
    setRows((now) => now.map((row, i) => (i === index ? Math.min(1, Math.max(0, row + by)) : row)));
  };
  return (
    <svg class="row-lines" viewBox="0 0 100 100" preserveAspectRatio="none">
      {rows.map((row, i) => (
        <g key={i} tabIndex={0} role="slider" aria-label={`row line ${i + 1}`} aria-valuenow={Math.round(100 * row)} onPointerDown={drag(i)} onKeyDown={nudge(i)}>
          <line class="grab" x1="0" x2="100" y1={100 * row} y2={100 * row} />
          <line x1="0" x2="100" y1={100 * row} y2={100 * row} />
        </g>
      ))}
    </svg>
  );
}

function Pair({source, scene: {file: scene, values}}: {source: SourceState; scene: SceneState}) {
  const {keys} = useKeys();
  const depth = (key: string) => textOf(at(values, ['map', key])) || keys.find((row) => row.key === `map.${key}`)?.default;
  const [frame, setFrame] = useState(source.frame);
  const [ask, sentence] = useAsk();
  useEffect(() => setFrame(source.frame), [source.frame]);
  return (
    <section class="pair">
      <h2>Rectified pair</h2>
      <div class="pair-picture">
        <img alt="left and right image, rectified" class={source.silent ? 'silent' : ''} src={`/api/source/pair.jpg?picture=${source.picture}&of=${encodeURIComponent(scene + source.timing + source.rectified_baseline_mm)}`} />
        <RowLines count={3} />
      </div>
      {source.silent && <div class="banner" role="alert">The source gives no pictures; it is started again until it comes back.</div>}
      {source.live && <Kept />}
      {!source.live && <label class="slider">
        frame {frame}
        <input type="range" min="0" max={Math.max(0, source.frames - 1)} value={frame} onInput={(e) => setFrame(Number(e.currentTarget.value))} onChange={(e) => void ask('look', {frame: Number(e.currentTarget.value)})} />
      </label>}
      {sentence && <p class="error" role="alert">{sentence}</p>}
      <p class="hint">The same place of the tissue must lie on the same line in both halves; drag a line to where there is much to see.</p>
      <dl class="figures wide">
        <dt>image</dt><dd>{source.width} × {source.height} px</dd>
        <dt>baseline</dt><dd>{source.baseline_mm.toFixed(2)} mm</dd>
        <dt>focal length</dt><dd>{source.focal_px.toFixed(0)} px</dd>
        <dt>field of view</dt><dd>{source.field_of_view_deg.map((deg) => deg.toFixed(0)).join(' × ')}°</dd>
        <dt>1 px of disparity at 80 mm</dt><dd>{(80 ** 2 / (source.rectified_focal_px * source.rectified_baseline_mm)).toFixed(2)} mm of depth</dd>
        <dt>depths searched</dt><dd>{depth('nearest_mm')} to {depth('farthest_mm')} mm</dd>
        <dt>recording</dt><dd>{source.timing}</dd>
      </dl>
      {source.notes.length > 0 && <ul class="warnings">{source.notes.map((note) => <li key={note}>{note}</li>)}</ul>}
    </section>
  );
}

export function SourcePanel() {
  const {source, scene} = useLive();
  return (
    <div class="source">
      <Browser />
      {source && scene ? (
        <div>
          <Pair source={source} scene={scene} />
          <GroupForm scene={scene} group="recording" />
        </div>
      ) : (
        <section class="welcome">
          <h2>From a recording to a force</h2>
          <ol>
            <li>Open a recording of both cameras with its calibration, or a scene.</li>
            <li>Draw the organ, say where it is held and what it is made of.</li>
            <li>Build the map from a frame in which the tissue is at rest.</li>
            <li>Run, and watch the force.</li>
          </ol>
        </section>
      )}
    </div>
  );
}
