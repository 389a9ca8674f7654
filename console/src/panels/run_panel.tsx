import {useEffect, useMemo, useRef, useState} from 'preact/hooks';
import {isForSomethingElse, useAsk, useLive, useNow} from '../model/hooks';
import {live} from '../model/live';
import {ForceChart} from '../parts/force_chart';
import {Gauge} from '../parts/gauge';
import {Kept} from '../parts/kept';
import {Lazy3d} from '../parts/lazy3d';
import {age_ms, LivePicture} from '../parts/live_picture';
import {wasLookedAt} from '../model/types';
import {Grip, StatusLamp} from '../parts/status';
import {Said} from '../parts/said';

function frameRate(): number {
  const times = live.drawn;
  const span = (times.at(-1) ?? 0) - (times[0] ?? 0);
  return times.length > 2 && span > 0 ? (1000 * (times.length - 1)) / span : 0;
}

function Figures() {
  useNow(250);
  const {run, roundTrip_ms, source} = live.state;
  if (!run) return null;
  const isLive = !!source?.live;
  const times = Object.entries(run.times_ms ?? {});
  const age = age_ms(live.drawn.at(-1) ?? 0);
  return (
    <dl class="figures">
      <dt>frame</dt>
      <dd data-testid="frame">
        {run.frame ?? '–'}
        {run.frames > 0 ? ` of ${run.frames}` : ''}
      </dd>
      <dt>shown</dt>
      <dd>{run.over ? '–' : `${frameRate().toFixed(0)} per s`}</dd>
      <dt>{isLive ? 'dropped' : 'passed over'}</dt>
      <dd data-testid="dropped">{isLive ? run.dropped : run.passed_over}</dd>
      <dt>latency</dt>
      <dd title={isLive ? 'from the stamp of the source to the picture drawn here' : 'from both pictures decoded to the picture drawn here'}>
        {run.over || !Number.isFinite(age) ? '–' : `${(age + roundTrip_ms / 2).toFixed(0)} ms`}
      </dd>
      {isLive && <dt>of it the source</dt>}
      {isLive && <dd title="from the stamp until both pictures were looked at">{run.waited_ms !== undefined ? `${run.waited_ms.toFixed(0)} ms` : '–'}</dd>}
      <dt>of it the answer</dt>
      <dd title={times.map(([name, ms]) => `${name} ${ms.toFixed(1)} ms`).join(', ')}>
        {run.answer_ms !== undefined ? `${run.answer_ms.toFixed(0)} ms` : '–'}
      </dd>
    </dl>
  );
}

export function RunPanel() {
  const state = useLive();
  const [ask, sentence, forget] = useAsk();
  const [isRealtime, setIsRealtime] = useState(true);
  const [shows3d, setShows3d] = useState(false);
  const [markText, setMarkText] = useState('');
  const page = useRef<HTMLDivElement>(null);
  const {run, rows, scene, map, phase, source} = state;
  const isRunning = !!run && !run.over;
  const row = rows.findLast(wasLookedAt) ?? null;
  const peak = useMemo(() => rows.reduce((most, r) => Math.max(most, r.magnitude_N), 0), [rows]);

  useEffect(() => {
    live.view({picture: true, shape: shows3d});
    return () => live.view({picture: false, shape: false});
  }, [shows3d]);

  const toggle = () => void (isRunning ? ask('stop') : ask('start', {realtime: isRealtime}));
  const mark = () => void ask('mark', {text: markText}).then((done) => done && setMarkText(''));
  const rest = () => void ask('rest');
  const fullScreen = () => {
    if (document.fullscreenElement) void document.exitFullscreen();
    else void page.current?.requestFullscreen();
  };
  useEffect(() => {
    const press = (event: KeyboardEvent) => {
      if (isForSomethingElse(event)) return;
      const keys: {[key: string]: () => void} = {r: toggle, m: mark, z: rest, f: fullScreen};
      keys[event.key.toLowerCase()]?.();
    };
    addEventListener('keydown', press);
    return () => removeEventListener('keydown', press);
  });

  if (!map && !run) return <p class="hint">There is no map yet: <a href="#build">build it</a> first.</p>;
  const unit = scene?.force_unit ?? 'N';
  const tissue = scene ? `E ${scene.young_modulus}, nu ${scene.poisson_ratio}, ${scene.law}` : '';
  return (
    <div class={`run ${shows3d ? 'with-3d' : ''}`} ref={page}>
      <div class="toolbar">
        <button class="primary" onClick={toggle} disabled={!isRunning && (phase === 'building' || !map || map.stale)}>
          {isRunning ? 'Stop' : 'Run and record'} <kbd>R</kbd>
        </button>
        {source?.live ? (
          <Kept />
        ) : (
          <label>
            <input type="checkbox" checked={isRealtime} disabled={isRunning} onChange={(e) => setIsRealtime(e.currentTarget.checked)} />
            at its own rate
          </label>
        )}
        <span class="group">
          <input aria-label="text of the mark" placeholder="text of a mark" value={markText} onInput={(e) => setMarkText(e.currentTarget.value)} />
          <button onClick={mark} disabled={!run?.frame && run?.frame !== 0}>
            Mark <kbd>M</kbd>
          </button>
        </span>
        <button onClick={rest} disabled={!isRunning} title="The present frame is the state at rest: the map is built again from it. Instrument away, tissue at rest.">
          Zero: map from this frame <kbd>Z</kbd>
        </button>
        <label>
          <input type="checkbox" checked={shows3d} onChange={(e) => setShows3d(e.currentTarget.checked)} />
          3D
        </label>
        <button onClick={fullScreen}>
          Surgeon’s view <kbd>F</kbd>
        </button>
      </div>
      <Said sentence={sentence} forget={forget} />
      {map?.stale && !isRunning && <div class="banner">The scene has changed since its map was built: <a href="#build">build again</a>.</div>}
      <div class="video">
        <LivePicture />
      </div>
      {shows3d && <Lazy3d shape={live.shape} colouring="stress" tip_mm={row && row.status !== 'tool_lost' ? row.tip_mm : undefined} force_N={row?.in_contact ? row.force_N : undefined} />}
      <aside>
        <StatusLamp row={row} />
        <Gauge row={row} peak_N={peak} unit={unit} tissue={tissue} />
        <Grip row={row} />
        <ul class="warnings" aria-label="warnings">
          {(run?.warnings ?? []).map((warning) => (
            <li key={warning}>{warning}</li>
          ))}
        </ul>
        <Figures />
      </aside>
      <ForceChart rows={rows} unit={unit} isLive={isRunning} />
      {run?.over && (
        <p class="ended">
          {run.end ? `${run.end}. ` : 'Ran to the end. '}
          Kept in <code>{run.folder}</code>: <a href={`#replay`}>replay</a>,{' '}
          <a href={`/api/replay/report?folder=${encodeURIComponent(run.folder)}`} target="_blank" rel="noreferrer">
            report
          </a>
          .
        </p>
      )}
      {run && run.marks.length > 0 && (
        <p class="marks">
          {run.marks.map(([frame, time, text]) => (
            <span key={`${frame}${text}`}>
              {time.toFixed(2)} s: {text}
            </span>
          ))}
        </p>
      )}
    </div>
  );
}
