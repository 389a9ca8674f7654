import {useEffect, useState} from 'preact/hooks';
import {useAsk, useLive} from '../model/hooks';
import {fetchShape, type Shape} from '../model/shape';
import type {MapState} from '../model/types';
import {Lazy3d} from '../parts/lazy3d';
import {Said} from '../parts/said';

const kStages: [string, string][] = [
  ['read', 'opened and read'], ['rectify', 'both cameras rectified'], ['match', 'points matched'],
  ['triangulate', 'points in space'], ['edges', 'edges of depth found'], ['surface', 'surface laid'],
  ['register', 'scan registered'], ['volume', 'body filled'], ['attachments', 'attachments set'],
];

function Stages({stages, isBuilding}: {stages: [string, number][]; isBuilding: boolean}) {
  const shown = kStages.filter(([name]) => name !== 'register' || stages.some(([stage]) => stage === name));
  const newest = stages.at(-1)?.[0];
  return (
    <ol class="stages">
      {shown.map(([name, words]) => {
        const ms = stages.filter(([stage]) => stage === name).reduce((sum, [, part]) => sum + part, 0);
        const has = stages.some(([stage]) => stage === name);
        const goesOn = isBuilding && newest === name;
        return (
          <li key={name} class={goesOn ? 'now' : has ? 'done' : ''}>
            <span>{words}</span>
            <span>{goesOn ? '…' : has ? (ms >= 1000 ? `${(ms / 1000).toFixed(1)} s` : `${ms} ms`) : ''}</span>
          </li>
        );
      })}
    </ol>
  );
}

function MapFigures({map}: {map: MapState}) {
  return (
    <dl class="figures wide">
      <dt>covered</dt><dd>{(100 * map.coverage).toFixed(0)} % of the organ region</dd>
      <dt>points</dt><dd>{map.counts.matched_points}</dd>
      <dt>depth deviation</dt><dd>{map.median_depth_deviation_mm.toFixed(2)} mm median</dd>
      <dt>row offset</dt><dd>{map.row_offset_px.toFixed(2)} px, corrected</dd>
      <dt>tetrahedra</dt><dd>{map.counts.elements}</dd>
      <dt>fixed nodes</dt><dd>{map.counts.fixed_nodes} of {map.counts.nodes}</dd>
      <dt>smallest angle</dt><dd>{map.smallest_dihedral_deg.toFixed(1)}°</dd>
      <dt>from frame</dt><dd>{map.frame < 0 ? 'live' : map.frame}</dd>
    </dl>
  );
}

export function BuildPanel() {
  const {phase, stages, map, source} = useLive();
  const [ask, sentence, forget] = useAsk();
  const [shape, setShape] = useState<Shape | null>(null);
  const [view, setView] = useState<'3d' | 'preview' | 'confidence'>('3d');
  const number = map?.number;
  useEffect(() => {
    setShape(null);
    if (number !== undefined) void fetchShape(`/api/map/shape?map=${number}`).then(setShape).catch(() => setShape(null));
  }, [number]);
  const isBuilding = phase === 'building';
  if (!source) return <p class="hint">No recording is open: <a href="#source">open one</a> first.</p>;
  return (
    <div class="build">
      <div class="toolbar">
        <button class="primary" disabled={isBuilding || phase === 'running'} onClick={() => void ask('build')}>{map ? 'Build again' : 'Build the map'}</button>
        <button disabled={!isBuilding} onClick={() => void ask('stop')}>Stop</button>
        <span class="group" role="group" aria-label="what is shown">
          {(['3d', 'preview', 'confidence'] as const).map((name) => (
            <button key={name} aria-pressed={view === name} class={view === name ? 'chosen' : ''} disabled={!map} onClick={() => setView(name)}>
              {{'3d': '3D', preview: 'Preview', confidence: 'What to believe'}[name]}
            </button>
          ))}
        </span>
        {map && !map.stale && <a class="button primary" href="#run">Go on to the run</a>}
      </div>
      <Said sentence={sentence} forget={forget} />
      {map?.stale && !isBuilding && <div class="banner">The scene has changed since this map was built.</div>}
      <div class="map-view">
        {!map && !isBuilding && <p class="hint">The map is built from the frame at rest, instrument away, that the scene names.</p>}
        {map && view === '3d' && <Lazy3d shape={shape} colouring="flags" />}
        {map && view !== '3d' && <img alt={view} src={`/api/map/${view}.jpg?map=${map.number}`} />}
      </div>
      <aside>
        <h2>Stages</h2>
        <Stages stages={stages} isBuilding={isBuilding} />
        {map && <MapFigures map={map} />}
        {map?.warnings && <ul class="warnings">{map.warnings.map((warning) => <li key={warning}>{warning}</li>)}</ul>}
      </aside>
    </div>
  );
}
