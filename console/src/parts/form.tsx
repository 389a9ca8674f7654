import {useEffect, useState} from 'preact/hooks';
import {useAsk, useKeys} from '../model/hooks';
import {at, textOf, unitOf, wordsOf, yamlOfText} from '../model/scene_yaml';
import type {KeyRow, SceneState} from '../model/types';

interface FieldProps {
  row: KeyRow;
  scene: SceneState;
}

/** One key: its value in the file, or its default, greyed; what it means and may be. */
export function Field({row, scene}: FieldProps) {
  const path = row.key.split('.'), name = path.at(-1)!;
  const written = textOf(at(scene.values, path));
  // What is being typed belongs to the value that it is to replace.
  const [typed, setTyped] = useState({of: written, text: written});
  const text = typed.of === written ? typed.text : written;
  const setText = (next: string) => setTyped({of: written, text: next});
  const [ask, sentence, forget] = useAsk();
  useEffect(forget, [written]);
  const put = (value: string) => {
    if (value.trim() === written) return forget();
    void ask('edit', {changes: [{path, value: yamlOfText(value)}]});
  };
  const words = row.values === 'true or false' ? ['true', 'false'] : wordsOf(row);
  const id = `key-${row.key}`, help = `${id}-help`, unit = unitOf(name);
  const isLong = /\[|path/.test(row.values);
  return (
    <div class={`field ${sentence ? 'bad' : ''}`}>
      <label for={id}>
        {name.replaceAll('_', ' ').replace(/ (mm|kPa|px|s|ms|deg|hz|N)$/, '')}
        {unit && <span class="unit"> {unit}</span>}
      </label>
      {words.length > 0 ? (
        <select id={id} aria-describedby={help} value={written} onChange={(e) => put(e.currentTarget.value)}>
          <option value="">{row.default ? `${row.default} (default)` : '–'}</option>
          {words.map((word) => (
            <option key={word} value={word}>
              {word}
            </option>
          ))}
        </select>
      ) : (
        <input
          id={id}
          class={isLong ? 'long' : ''}
          inputMode={row.values.includes('x') && !isLong ? 'decimal' : 'text'}
          aria-describedby={help}
          aria-invalid={sentence !== ''}
          placeholder={row.default}
          value={text}
          onInput={(e) => setText(e.currentTarget.value)}
          onBlur={(e) => put(e.currentTarget.value)}
          onKeyDown={(e) => {
            if (e.key === 'Enter') put(e.currentTarget.value);
            if (e.key === 'Escape') {
              setText(written);
              forget();
            }
          }}
        />
      )}
      <p class="help" id={help}>
        {row.meaning}
        {words.length === 0 && row.values && <span class="range"> [{row.values}]</span>}
      </p>
      {sentence && (
        <p class="error" role="alert">
          {sentence.replace(/^[^:]*:\d+: /, '')}
        </p>
      )}
    </div>
  );
}

interface FormProps {
  scene: SceneState;
  /** "map" */
  group: string;
  /** Keys that stand elsewhere on the page. */
  without?: string[];
  open?: boolean;
}

/** The keys of a group that hold a value of their own, from the program's own description. */
export function GroupForm({scene, group, without = [], open}: FormProps) {
  const {keys} = useKeys();
  const own = keys.find((row) => row.key === group);
  const rows = keys.filter(
    (row) => row.key.startsWith(`${group}.`) && !row.key.includes('[]') && !['group', 'list'].includes(row.values) && !without.includes(row.key),
  );
  if (!rows.length) return null;
  return (
    <details class="group-form" open={open}>
      <summary>
        {group} <small>{own?.meaning}</small>
      </summary>
      {rows.map((row) => (
        <Field key={row.key} row={row} scene={scene} />
      ))}
    </details>
  );
}
