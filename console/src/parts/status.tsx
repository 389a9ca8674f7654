import type {Row} from '../model/types';

const kWords: {[status: string]: [string, string]} = {
  ok: ['contact', 'the force is valid'],
  no_contact: ['no contact', 'the instrument is free'],
  tool_lost: ['instrument lost', 'neither tip nor tissue tells the force'],
  not_converged: ['no force', 'the model found no equilibrium'],
  map_stale: ['map out of date', 'the force is not to be trusted: build again'],
};

export function StatusLamp({row}: {row: Row | null}) {
  const [name, meaning] = kWords[row?.status ?? ''] ?? ['no frame yet', ''];
  return (
    <p class={`lamp ${row?.status ?? ''}`} role="status">
      <span class="light" aria-hidden="true" />
      <strong>{name}</strong>
      <small>{meaning}</small>
    </p>
  );
}

export function Grip({row}: {row: Row | null}) {
  const probability = row?.p_contact ?? 0;
  return (
    <div class="grip">
      <span>
        grip <strong>{row?.grip ?? '–'}</strong>
      </span>
      <meter min={0} max={1} value={probability} aria-label="probability of contact" />
      <span>{Math.round(100 * probability)} % contact</span>
    </div>
  );
}
