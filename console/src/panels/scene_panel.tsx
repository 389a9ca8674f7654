import {useEffect, useState} from 'preact/hooks';
import {useAsk, useKeys, useLive} from '../model/hooks';
import {type Change, at, type Point, pointsOf, presetsOf, yamlOfPoints, yamlOfText} from '../model/scene_yaml';
import type {SceneState, Yaml} from '../model/types';
import {Attachments} from '../parts/attachments';
import {Drawing, type Outline} from '../parts/drawing';
import {Field, GroupForm} from '../parts/form';
import {Said} from '../parts/said';

type Tool = 'none' | 'polygon' | 'lasso' | 'point';

function listOf(value: Yaml | undefined): Yaml[] {
  return Array.isArray(value) ? value : [];
}

function outlinesOf(scene: SceneState): Outline[] {
  const outlines: Outline[] = [
    {id: 'organ', name: 'the organ', kind: 'organ', points: pointsOf(at(scene.values, ['map', 'organ_region_px']))},
    {id: 'focus', name: 'the finer part', kind: 'focus', points: pointsOf(at(scene.values, ['map', 'focus_px']))},
    {id: 'example', name: 'the instrument', kind: 'example', points: pointsOf(at(scene.values, ['instrument', 'example_px']))},
  ];
  listOf(at(scene.values, ['attachments'])).forEach((item, i) => {
    const points = pointsOf(at(item, ['polygon_px']));
    if (points.length) outlines.push({id: `attachment-${i}`, name: `attachment ${i + 1}`, kind: 'attachment', points});
  });
  listOf(at(scene.values, ['map', 'labels'])).forEach((item, i) =>
    outlines.push({id: `label-${i}`, name: String(at(item, ['name']) ?? ''), kind: 'label', points: pointsOf(at(item, ['region_px']))}),
  );
  return outlines.filter((outline) => outline.points.length > 0);
}

/** What a drawn outline changes in the file. */
function changeFor(id: string, points: Point[], frame: number, label: {name: string; modulus: string}): Change[] {
  const yaml = yamlOfPoints(points), [kind, number] = id.split('-') as [string, string | undefined];
  if (kind === 'organ') return [{path: ['map', 'organ_region_px'], value: yaml}];
  if (kind === 'focus') return [{path: ['map', 'focus_px'], value: yaml}];
  if (kind === 'example')
    return [{path: ['instrument', 'example_px'], value: yaml.slice(1, -1)}, {path: ['instrument', 'at_frame'], value: String(frame)}];
  if (id === 'attachment-new') return [{path: ['attachments', '+'], value: `{polygon_px: ${yaml}}`}];
  if (kind === 'attachment') return [{path: ['attachments', number!, 'polygon_px'], value: yaml}];
  if (id === 'label-new') {
    const item = `{name: ${yamlOfText(label.name)}, region_px: ${yaml}, tissue: {young_modulus_kPa: ${label.modulus}}}`;
    return [{path: ['map', 'labels', '+'], value: item}];
  }
  return [{path: ['map', 'labels', number!, 'region_px'], value: yaml}];
}

function Presets({scene, edit}: {scene: SceneState; edit: (changes: Change[]) => void}) {
  const presets = presetsOf(useKeys().keys.find((row) => row.key === 'tissue.preset'));
  const chosen = at(scene.values, ['tissue', 'preset']);
  const take = (name: string) =>
    edit([
      {path: ['tissue', 'preset'], value: name},
      {path: ['tissue', 'young_modulus_kPa'], value: ''},
      {path: ['tissue', 'poisson_ratio'], value: ''},
    ]);
  const takeNumbers = () => {
    const preset = presets.find((one) => one.name === chosen);
    if (!preset) return;
    edit([
      {path: ['tissue', 'young_modulus_kPa'], value: preset.young_modulus_kPa},
      {path: ['tissue', 'poisson_ratio'], value: preset.poisson_ratio},
      {path: ['tissue', 'preset'], value: ''},
    ]);
  };
  return (
    <fieldset class="presets">
      <legend>tissue from literature</legend>
      {presets.map((preset) => (
        <label key={preset.name}>
          <input type="radio" name="preset" checked={chosen === preset.name} onChange={() => take(preset.name)} />
          <span>
            {preset.name} <strong>{preset.young_modulus_kPa} kPa</strong>, nu {preset.poisson_ratio}
            <small>{preset.source}</small>
          </span>
        </label>
      ))}
      <label>
        <input type="radio" name="preset" checked={chosen === undefined} onChange={takeNumbers} />
        <span>own numbers</span>
      </label>
    </fieldset>
  );
}

export function ScenePanel() {
  const {scene, source, phase} = useLive();
  const {keys} = useKeys();
  const [ask, sentence, forget] = useAsk();
  const [active, setActive] = useState('organ');
  const [tool, setTool] = useState<Tool>('none');
  const [label, setLabel] = useState({name: 'tumour', modulus: '60'});
  const [saved, setSaved] = useState('');
  const file = scene?.file.split('/').at(-1) ?? '';
  const [typed, setTyped] = useState({of: file, name: file});
  const name = typed.of === file ? typed.name : file;
  const setName = (next: string) => setTyped({of: file, name: next});

  const edit = (changes: Change[]) => void ask('edit', {changes});
  const begin = (id: string, next: Tool) => {
    setActive(id);
    setTool(next);
  };
  const change = (id: string, points: Point[]) => {
    edit(changeFor(id, points, source?.frame ?? 0, label));
    setTool('none');
    if (id.endsWith('-new')) setActive('organ');
  };
  const save = async () => {
    if (await ask('save', {name})) {
      setSaved(`saved as ${name}`);
      setTimeout(() => setSaved(''), 4000);
    }
  };
  useEffect(() => {
    const press = (event: KeyboardEvent) => {
      if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== 'z') return;
      if (event.target instanceof HTMLElement && event.target.matches('input, textarea')) return;
      event.preventDefault();
      void ask(event.shiftKey ? 'redo' : 'undo');
    };
    addEventListener('keydown', press);
    return () => removeEventListener('keydown', press);
  }, []);

  if (!scene || !source) return <p class="hint">No recording is open: <a href="#source">open one</a> first.</p>;
  const attachments = listOf(at(scene.values, ['attachments']));
  const isBusy = phase === 'building' || phase === 'running';
  const draws = (id: string, next: Tool) => ({
    class: active === id && tool === next ? 'chosen' : '',
    'aria-pressed': active === id && tool === next,
    onClick: () => begin(id, active === id && tool === next ? 'none' : next),
  });
  const row = (key: string) => keys.find((one) => one.key === key);
  const key = (name: string) => (row(name) ? <Field row={row(name)!} scene={scene} /> : null);
  return (
    <div class="scene" inert={isBusy}>
      <div class="toolbar" role="toolbar" aria-label="drawing">
        <span class="group">
          organ
          <button {...draws('organ', 'polygon')}>Polygon</button>
          <button {...draws('organ', 'lasso')}>Lasso</button>
        </span>
        <span class="group">
          held at
          <button {...draws('attachment-new', 'polygon')}>Region</button>
          <button onClick={() => edit([{path: ['attachments', '+'], value: '{underside: {depth_mm: 3}}'}])}>Underside</button>
        </span>
        <span class="group">
          finer
          <button {...draws('focus', 'polygon')}>Focus</button>
          <button disabled={!at(scene.values, ['map', 'focus_px'])} onClick={() => edit([{path: ['map', 'focus_px'], value: ''}])}>None</button>
        </span>
        <span class="group">
          instrument
          <button {...draws('example', 'point')}>Show it</button>
        </span>
        <button disabled={!scene.can_undo} onClick={() => void ask('undo')}>Undo</button>
        <button disabled={!scene.can_redo} onClick={() => void ask('redo')}>Redo</button>
        <span class="group save">
          <input aria-label="name of the scene file" value={name} onInput={(e) => setName(e.currentTarget.value)} />
          <button class="primary" onClick={() => void save()} disabled={scene.saved && name === file}>Save</button>
          <span role="status">{saved}</span>
        </span>
      </div>
      <Said sentence={sentence} forget={forget} />
      <div class="picture">
        <Drawing
          image={`/api/source/left.jpg?picture=${source.picture}&of=${encodeURIComponent(scene.file)}`}
          width={source.width} height={source.height} outlines={outlinesOf(scene)} active={active} tool={tool} change={change}
        />
        <p class="hint">
          {tool === 'polygon' && 'A press sets a corner; the first corner or Enter closes, Escape gives up.'}
          {tool === 'lasso' && 'Draw around it with the button held.'}
          {tool === 'point' && 'Press on the instrument.'}
          {tool === 'none' && 'Corners move by pointer or arrow keys; a double press on a side adds one, Delete or Alt-press takes one away.'}
        </p>
      </div>
      <aside class="forms">
        <h2>Organ</h2>
        {key('map.thickness_mm')}
        {key('map.elements')}
        {key('map.frame')}
        <h2>Held at</h2>
        <Attachments attachments={attachments} edit={edit} active={active} choose={setActive} />
        <h2>Tissue</h2>
        <Presets scene={scene} edit={edit} />
        {at(scene.values, ['tissue', 'preset']) === undefined && key('tissue.young_modulus_kPa')}
        {at(scene.values, ['tissue', 'preset']) === undefined && key('tissue.poisson_ratio')}
        {key('tissue.law')}
        <details class="group-form">
          <summary>parts with a stiffness of their own</summary>
          <ul class="attachments">
            {listOf(at(scene.values, ['map', 'labels'])).map((item, i) => (
              <li key={i}>
                <button class="link" onClick={() => setActive(`label-${i}`)}>{String(at(item, ['name']) ?? i)}</button>
                <small>{String(at(item, ['tissue', 'young_modulus_kPa']) ?? '')} kPa</small>
                <button class="small" aria-label="remove" onClick={() => edit([{path: ['map', 'labels', String(i)], value: ''}])}>×</button>
              </li>
            ))}
          </ul>
          <span class="group">
            <input aria-label="name of the part" value={label.name} onInput={(e) => setLabel({...label, name: e.currentTarget.value})} />
            <input aria-label="Young's modulus, kPa" class="short" value={label.modulus} onInput={(e) => setLabel({...label, modulus: e.currentTarget.value})} />
            kPa
            <button {...draws('label-new', 'polygon')}>Draw</button>
          </span>
        </details>
        <GroupForm scene={scene} group="contact" />
        <GroupForm scene={scene} group="instrument" />
        <GroupForm scene={scene} group="uncertainty" />
        <GroupForm scene={scene} group="map" without={['map.thickness_mm', 'map.elements', 'map.frame', 'map.organ_region_px', 'map.focus_px']} />
        <GroupForm scene={scene} group="overlay" />
        <GroupForm scene={scene} group="tuning" />
        <details class="group-form">
          <summary>scene.yaml <small>as it would be saved</small></summary>
          <pre class="yaml">{scene.text}</pre>
        </details>
      </aside>
    </div>
  );
}
