import {useEffect, useRef} from 'preact/hooks';
import {useNow} from '../model/hooks';
import {live} from '../model/live';

/** Older than this a picture does not count as live. */
export const kFrozen_ms = 200;

export function age_ms(now: number): number {
  const picture = live.picture;
  return picture ? now - picture.arrived + picture.ageAtArrival_ms : Infinity;
}

/** The overlay as it comes; greyed and labelled as soon as it is not of this moment. */
export function LivePicture() {
  const canvas = useRef<HTMLCanvasElement>(null);
  const drawn = useRef<ImageBitmap | null>(null);
  useEffect(() => {
    const draw = () => {
      const to = canvas.current, picture = live.picture;
      if (!to || !picture || drawn.current === picture.bitmap) return;
      drawn.current = picture.bitmap;
      if (to.width !== picture.bitmap.width || to.height !== picture.bitmap.height) {
        to.width = picture.bitmap.width;
        to.height = picture.bitmap.height;
      }
      to.getContext('2d')?.drawImage(picture.bitmap, 0, 0);
      to.dataset['frame'] = String(picture.frame);
      to.dataset['age'] = age_ms(performance.now()).toFixed(1);
    };
    draw();
    return live.listen(draw);
  }, []);
  const age = age_ms(useNow(50));
  const {run, connected} = live.state;
  const isFrozen = age > kFrozen_ms;
  const label = !connected
    ? 'no connection'
    : run?.over
      ? `ended at frame ${live.picture?.frame ?? 0} — not live`
      : Number.isFinite(age)
        ? `frozen for ${(age / 1000).toFixed(1)} s`
        : 'no picture yet';
  return (
    <div class={`live-picture ${isFrozen ? 'frozen' : ''}`}>
      <canvas ref={canvas} width={960} height={540} role="img" aria-label="overlay video" />
      {isFrozen && <span class="frozen-label">{label}</span>}
    </div>
  );
}
