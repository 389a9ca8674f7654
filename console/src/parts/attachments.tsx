import {useEffect, useState} from 'preact/hooks';
import {shortTextOf} from '../model/scene_yaml';
import type {Yaml} from '../model/types';

interface Props {
  attachments: Yaml[];
  edit: (changes: {path: string[]; value: string}[]) => void;
  active: string;
  choose: (id: string) => void;
}

const kNames: {[kind: string]: string} = {
  underside: 'underside', polygon_px: 'region, through the depth', box: 'box', oriented_box: 'turned box', sphere: 'sphere',
};

function Underside({depth, change}: {depth: number; change: (depth: string) => void}) {
  const [now, setNow] = useState(depth);
  useEffect(() => setNow(depth), [depth]);
  return (
    <label class="slider">
      depth {now.toFixed(1)} mm
      <input type="range" min="0.5" max="25" step="0.5" value={now} onInput={(e) => setNow(Number(e.currentTarget.value))} onChange={(e) => change(e.currentTarget.value)} />
    </label>
  );
}

/** Where the tissue is held: the union of these. */
export function Attachments({attachments, edit, active, choose}: Props) {
  return (
    <ul class="attachments">
      {attachments.map((item, i) => {
        const group = typeof item === 'object' && !Array.isArray(item) ? item : {};
        const kind = Object.keys(group)[0] ?? '', value = group[kind], id = `attachment-${i}`;
        const depth = typeof value === 'object' && !Array.isArray(value) ? value['depth_mm'] : undefined;
        return (
          <li key={id} class={active === id ? 'active' : ''}>
            {kind === 'polygon_px' ? (
              <button class="link" onClick={() => choose(id)}>
                {kNames[kind]}
              </button>
            ) : (
              <span>{kNames[kind] ?? kind}</span>
            )}
            {kind === 'underside' && (
              <Underside depth={Number(depth ?? 3)} change={(mm) => edit([{path: ['attachments', String(i), 'underside'], value: `{depth_mm: ${mm}}`}])} />
            )}
            {!['underside', 'polygon_px'].includes(kind) && <small>{shortTextOf(value)}</small>}
            <button class="small" aria-label={`remove ${kNames[kind] ?? kind}`} onClick={() => edit([{path: ['attachments', String(i)], value: ''}])}>
              ×
            </button>
          </li>
        );
      })}
    </ul>
  );
}
