import {useEffect, useRef, useState} from 'preact/hooks';
import uPlot from 'uplot';
import {type Row, wasLookedAt} from '../model/types';

const kWindow_s = 10, kLegend_px = 26;

interface Props {
  rows: Row[];
  unit: string;
  /** Follows the end of the rows until it is zoomed. */
  isLive: boolean;
  /** A line at this moment, and what is called when another one is chosen. */
  at_s?: number;
  choose?: (time_s: number) => void;
}

function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Frames that were passed over tell nothing and break no line. */
function dataOf(all: Row[]): uPlot.AlignedData {
  const rows = all.filter(wasLookedAt);
  const known = (row: Row, value: number) => (row.status === 'tool_lost' || row.status === 'not_converged' ? null : value);
  return [
    rows.map((row) => row.time_s),
    rows.map((row) => known(row, row.high_N)),
    rows.map((row) => known(row, row.low_N)),
    rows.map((row) => known(row, row.magnitude_N)),
  ];
}

/** Without a pointer over it the chart reads out a moment, or the last value. */
function readOut(u: uPlot, time_s: number | undefined) {
  const times = u.data[0];
  if ((u.cursor.left ?? -1) >= 0 || times.length === 0) return;
  let idx = times.length - 1;
  if (time_s !== undefined) times.forEach((time, i) => Math.abs(time - time_s) < Math.abs(times[idx]! - time_s) && (idx = i));
  u.setLegend({idx}, false);
}

/** Shows this part of the time, and forces up to the highest in it. */
function zoom(u: uPlot, min: number, max: number) {
  let most = 0;
  u.data[0].forEach((time, i) => {
    if (time >= min && time <= max) most = Math.max(most, u.data[1]?.[i] ?? 0, u.data[3]?.[i] ?? 0);
  });
  u.batch(() => {
    u.setScale('x', {min, max});
    u.setScale('y', {min: 0, max: Math.max(0.1, most * 1.08)});
  });
}

/** The wheel zooms around the pointer, a drag with the middle button or shift pans. */
function wheelAndPan(isMoved: () => void): uPlot.Plugin {
  return {
    hooks: {
      ready: (plot) => {
        plot.over.addEventListener('wheel', (event) => {
          event.preventDefault();
          const {min, max} = plot.scales['x']!;
          if (min == null || max == null) return;
          const at = plot.posToVal(event.offsetX, 'x'), factor = event.deltaY < 0 ? 0.8 : 1.25;
          isMoved();
          zoom(plot, at - (at - min) * factor, at + (max - at) * factor);
        });
        plot.over.addEventListener('pointerdown', (event) => {
          if (event.button !== 1 && !event.shiftKey) return;
          event.preventDefault();
          event.stopImmediatePropagation();
          isMoved();
          const {min, max} = plot.scales['x']!, start = event.clientX;
          const perPixel = (max! - min!) / plot.over.clientWidth;
          const move = (moved: PointerEvent) => {
            const by = (start - moved.clientX) * perPixel;
            zoom(plot, min! + by, max! + by);
          };
          const up = () => {
            removeEventListener('pointermove', move);
            removeEventListener('pointerup', up);
          };
          addEventListener('pointermove', move);
          addEventListener('pointerup', up);
        }, true);
      },
    },
  };
}

function save(name: string, blob: Blob) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/** Force over time with its 95 % band. */
export function ForceChart({rows, unit, isLive, at_s, choose}: Props) {
  const place = useRef<HTMLDivElement>(null);
  const plot = useRef<uPlot | null>(null);
  const follows = useRef(true);
  const moment = useRef<number | undefined>(at_s);
  const chosen = useRef(choose);
  const [isFollowing, setIsFollowing] = useState(true);
  moment.current = at_s;
  chosen.current = choose;
  const setFollows = (value: boolean) => {
    follows.current = value;
    setIsFollowing(value);
  };

  useEffect(() => {
    const host = place.current!;
    const axis = {stroke: colour('--muted'), grid: {stroke: colour('--line'), width: 1}, ticks: {stroke: colour('--line')}};
    const options: uPlot.Options = {
      width: host.clientWidth || 600, height: host.clientHeight || 160,
      scales: {x: {time: false}, y: {auto: false, min: 0, max: 1}},
      axes: [{...axis, values: (_, ticks) => ticks.map((tick) => `${+tick.toFixed(2)} s`)}, {...axis, size: 52, label: unit, labelSize: 18, labelGap: 0}],
      series: [
        {label: 'time', value: (_, value) => (value == null ? '–' : `${value.toFixed(2)} s`)},
        {label: 'high', stroke: colour('--band'), width: 1, value: (_, v) => (v == null ? '–' : v.toFixed(3))},
        {label: 'low', stroke: colour('--band'), width: 1, value: (_, v) => (v == null ? '–' : v.toFixed(3))},
        {label: `force ${unit}`, stroke: colour('--force'), width: 2, value: (_, v) => (v == null ? '–' : v.toFixed(3))},
      ],
      bands: [{series: [1, 2], fill: colour('--band-fill')}],
      cursor: {drag: {x: true, y: false, setScale: false}, points: {size: 6}},
      legend: {live: true},
      plugins: [wheelAndPan(() => setFollows(false))],
      hooks: {
        setSelect: [(u) => {
          const {left, width} = u.select;
          if (width < 3) return;
          u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
          setFollows(false);
          zoom(u, u.posToVal(left, 'x'), u.posToVal(left + width, 'x'));
        }],
        draw: [(u) => {
          if (moment.current === undefined) return;
          const x = u.valToPos(moment.current, 'x', true);
          u.ctx.fillStyle = colour('--accent');
          u.ctx.fillRect(x - 1, u.bbox.top, 2, u.bbox.height);
        }],
      },
    };
    const made = new uPlot(options, dataOf([]), host);
    plot.current = made;
    made.over.addEventListener('dblclick', () => setFollows(true));
    made.over.addEventListener('click', (event) => chosen.current?.(made.posToVal(event.offsetX, 'x')));
    const fit = new ResizeObserver(() => {
      made.setSize({width: host.clientWidth, height: Math.max(60, host.clientHeight - kLegend_px)});
    });
    fit.observe(host);
    return () => {
      fit.disconnect();
      made.destroy();
      plot.current = null;
    };
  }, [unit]);

  useEffect(() => {
    const made = plot.current;
    if (!made) return;
    made.setData(dataOf(rows), false);
    const end = rows.at(-1)?.time_s ?? 0, begin = rows[0]?.time_s ?? 0;
    if (!follows.current) made.redraw();
    else if (isLive) zoom(made, Math.max(begin, end - kWindow_s), Math.max(end, begin + 1));
    else zoom(made, begin, Math.max(end, begin + 0.1));
    readOut(made, moment.current);
  }, [rows, isLive, isFollowing, unit]);
  useEffect(() => {
    if (!plot.current) return;
    plot.current.redraw(false);
    readOut(plot.current, at_s);
  }, [at_s]);

  const saveCsv = () => {
    const {min, max} = plot.current!.scales['x']!;
    const seen = rows.filter((row) => row.time_s >= (min ?? 0) && row.time_s <= (max ?? Infinity));
    const lines = seen.map((r) => [r.frame, r.time_s, r.status, ...r.force_N, r.magnitude_N, r.low_N, r.high_N].join(','));
    save('forces_window.csv', new Blob([['frame,time_s,status,fx_N,fy_N,fz_N,force_N,force_low_N,force_high_N', ...lines, ''].join('\n')], {type: 'text/csv'}));
  };
  const savePng = () => plot.current!.ctx.canvas.toBlob((blob) => blob && save('forces_window.png', blob));

  return (
    <section class="chart" aria-label="force over time">
      <div class="plot" ref={place} />
      <div class="chart-tools">
        {!isFollowing && <button onClick={() => setFollows(true)}>{isLive ? 'Follow' : 'All'}</button>}
        <button onClick={saveCsv} disabled={!rows.length}>CSV</button>
        <button onClick={savePng} disabled={!rows.length}>PNG</button>
      </div>
    </section>
  );
}
