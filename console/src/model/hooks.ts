import {useEffect, useState} from 'preact/hooks';
import {live, type LiveState} from './live';
import type {KeyRow} from './types';

/** The program's state, followed. */
export function useLive(): LiveState {
  const [, setCount] = useState(0);
  useEffect(() => live.listen(() => setCount((count) => count + 1)), []);
  return live.state;
}

/** A moment that goes on, in steps. */
export function useNow(step_ms: number): number {
  const [now, setNow] = useState(performance.now());
  useEffect(() => {
    const timer = setInterval(() => setNow(performance.now()), step_ms);
    return () => clearInterval(timer);
  }, [step_ms]);
  return now;
}

/** A key that belongs to what is written, or to the browser. */
export function isForSomethingElse(event: KeyboardEvent): boolean {
  const isWriting = event.target instanceof HTMLElement && event.target.matches('input:not([type=checkbox], [type=range], [type=radio]), select, textarea');
  return isWriting || event.ctrlKey || event.metaKey || event.altKey;
}

interface Keys {
  keys: KeyRow[];
  warnings: {[name: string]: string};
}
let keysOnce: Promise<Keys> | null = null;

/** Every key of the scene file, as the program describes it. */
export function useKeys(): Keys {
  const [keys, setKeys] = useState<Keys>({keys: [], warnings: {}});
  useEffect(() => {
    keysOnce ??= fetch('/api/keys').then((answer) => answer.json() as Promise<Keys>);
    keysOnce.then(setKeys).catch(() => (keysOnce = null));
  }, []);
  return keys;
}

/** What came of the last thing asked for: a sentence, or nothing. */
export function useAsk(): [(what: string, fields?: object) => Promise<boolean>, string, () => void] {
  const [sentence, setSentence] = useState('');
  const ask = async (what: string, fields: object = {}) => {
    try {
      await live.ask(what, fields);
      setSentence('');
      return true;
    } catch (error) {
      setSentence((error as Error).message);
      return false;
    }
  };
  return [ask, sentence, () => setSentence('')];
}
