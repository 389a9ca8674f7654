import {useEffect, useMemo, useState} from 'preact/hooks';
import {useKeys, useLive} from '../model/hooks';
import {fetchShape, type Shape} from '../model/shape';
import {type Row, rowOf} from '../model/types';
import {ForceChart} from '../parts/force_chart';
import {Gauge} from '../parts/gauge';
import {Lazy3d} from '../parts/lazy3d';
import {Grip, StatusLamp} from '../parts/status';

interface Finished {
  rows: Row[];
  shapes: number[];
  has_report: boolean;
  has_video: boolean;
}

function useRuns(changed: unknown): string[] {
  const [runs, setRuns] = useState<string[]>([]);
  useEffect(() => {
    fetch('/api/runs')
      .then((answer) => answer.json())
      .then(({runs: found}: {runs: {folder: string}[]}) => setRuns(found.map((run) => run.folder)))
      .catch(() => setRuns([]));
  }, [changed]);
  return runs;
}

/** The picture of a moment; while one is on its way the last one stays. */
function usePicture(folder: string, frame: number, has: boolean): string {
  const [url, setUrl] = useState('');
  useEffect(() => {
    if (!folder || !has) return setUrl('');
    const gone = new AbortController();
    fetch(`/api/replay/picture?folder=${encodeURIComponent(folder)}&frame=${frame}`, {signal: gone.signal})
      .then((answer) => (answer.ok ? answer.blob() : null))
      .then((blob) => {
        if (!blob || gone.signal.aborted) return;
        const next = URL.createObjectURL(blob);
        setUrl((last) => {
          if (last) setTimeout(() => URL.revokeObjectURL(last), 500);
          return next;
        });
      })
      .catch(() => undefined);
    return () => gone.abort();
  }, [folder, frame, has]);
  return url;
}

export function ReplayPanel() {
  const {run} = useLive();
  const {warnings} = useKeys();
  const runs = useRuns(run?.over);
  const [folder, setFolder] = useState('');
  const [finished, setFinished] = useState<Finished | null>(null);
  const [index, setIndex] = useState(0);
  const [isPlaying, setIsPlaying] = useState(false);
  const [shape, setShape] = useState<Shape | null>(null);
  useEffect(() => {
    if (!folder && runs[0]) setFolder(run?.over && runs.includes(run.folder) ? run.folder : runs[0]);
  }, [runs]);
  useEffect(() => {
    setFinished(null);
    setIndex(0);
    if (!folder) return;
    fetch(`/api/replay/rows?folder=${encodeURIComponent(folder)}`)
      .then((answer) => answer.json())
      .then((found: Omit<Finished, 'rows'> & {rows: unknown[]}) => setFinished({...found, rows: found.rows.map(rowOf)}))
      .catch(() => setFinished(null));
  }, [folder]);
  const rows = finished?.rows ?? [];
  const row = rows[index] ?? null;
  const picture = usePicture(folder, index, !!finished?.has_video);
  const hasShapes = !!finished?.shapes.length;
  useEffect(() => {
    if (!hasShapes || !row) return setShape(null);
    let isWanted = true;
    void fetchShape(`/api/replay/shape?folder=${encodeURIComponent(folder)}&frame=${row.frame}`).then((found) => isWanted && setShape(found)).catch(() => undefined);
    return () => { isWanted = false; };
  }, [folder, row?.frame, hasShapes]);
  useEffect(() => {
    if (!isPlaying || rows.length < 2) return;
    const step = (1000 * (rows.at(-1)!.time_s - rows[0]!.time_s)) / (rows.length - 1);
    const timer = setInterval(() => setIndex((now) => {
      if (now + 1 >= rows.length) setIsPlaying(false);
      return Math.min(now + 1, rows.length - 1);
    }), Math.max(30, step));
    return () => clearInterval(timer);
  }, [isPlaying, rows]);
  const peak = useMemo(() => rows.reduce((most, r) => Math.max(most, r.magnitude_N), 0), [rows]);
  const choose = (time: number) => {
    const nearest = rows.reduce((best, r, i) => (Math.abs(r.time_s - time) < Math.abs(rows[best]!.time_s - time) ? i : best), 0);
    setIndex(nearest);
  };
  if (!runs.length) return <p class="hint">There is no finished run below this folder yet.</p>;
  return (
    <div class="run replay with-3d">
      <div class="toolbar">
        <label>
          run
          <select value={folder} onChange={(e) => setFolder(e.currentTarget.value)}>{runs.map((name) => <option key={name}>{name}</option>)}</select>
        </label>
        <button class="primary" disabled={rows.length < 2} onClick={() => {
          if (!isPlaying && index + 1 >= rows.length) setIndex(0);
          setIsPlaying(!isPlaying);
        }}>{isPlaying ? 'Pause' : 'Play'}</button>
        <label class="slider scrub">
          frame {row?.frame ?? 0}
          <input type="range" min="0" max={Math.max(0, rows.length - 1)} value={index} onInput={(e) => setIndex(Number(e.currentTarget.value))} />
          {row?.time_s.toFixed(2) ?? '0'} s
        </label>
        {finished?.has_report && <a class="button" href={`/api/replay/report?folder=${encodeURIComponent(folder)}`} target="_blank" rel="noreferrer">Report</a>}
      </div>
      <div class="video">
        {picture ? <img alt={`frame ${row?.frame}`} src={picture} /> : <p class="hint">no video</p>}
        <span class="recorded">recorded</span>
      </div>
      {hasShapes ? (
        <Lazy3d shape={shape} colouring="stress" tip_mm={row && row.status !== 'tool_lost' ? row.tip_mm : undefined} force_N={row?.in_contact ? row.force_N : undefined} />
      ) : (
        <p class="hint">This run kept no shapes.</p>
      )}
      <aside>
        <StatusLamp row={row} />
        <Gauge row={row} peak_N={peak} unit="N" tissue="the tissue that run.yaml names" />
        <Grip row={row} />
        <ul class="warnings">{(row?.warnings ? row.warnings.split(';') : []).map((name) => <li key={name}>{warnings[name] ?? name}</li>)}</ul>
      </aside>
      <ForceChart rows={rows} unit="N" isLive={false} at_s={row?.time_s ?? 0} choose={choose} />
    </div>
  );
}
