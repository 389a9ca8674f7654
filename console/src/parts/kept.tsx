import {useEffect} from 'preact/hooks';
import {isForSomethingElse, useAsk, useLive} from '../model/hooks';
import {Said} from './said';

/** Keeps the video of a live source. */
export function Kept() {
  const {kept, phase} = useLive();
  const [ask, sentence, forget] = useAsk();
  const goesOn = !!kept && !kept.over;
  const toggle = () => void ask('record', {on: !goesOn});
  useEffect(() => {
    const press = (event: KeyboardEvent) => {
      if (!isForSomethingElse(event) && event.key.toLowerCase() === 'v') toggle();
    };
    addEventListener('keydown', press);
    return () => removeEventListener('keydown', press);
  });
  return (
    <span class="kept">
      <button class={goesOn ? 'recording' : ''} disabled={phase === 'building'} onClick={toggle}>
        {goesOn ? 'Stop the video' : 'Record the video'} <kbd>V</kbd>
      </button>
      {kept && (
        <span role="status">
          {kept.seconds.toFixed(1)} s, {kept.frames} frames in <code>{kept.folder}</code>
          {kept.left_out > 0 && `, ${kept.left_out} left out: the computer cannot keep up`}
          {kept.end && `, ended: ${kept.end}`}
        </span>
      )}
      <Said sentence={sentence} forget={forget} />
    </span>
  );
}
