import {live} from '../model/live';

/** Why what was asked for could not be done; nothing where the head of the page says it already. */
export function Said({sentence, forget}: {sentence: string; forget: () => void}) {
  if (!sentence || sentence === live.state.sentence) return null;
  return (
    <div class="banner" role="alert">
      {sentence} <button onClick={forget}>Close</button>
    </div>
  );
}
