import {useEffect, useRef, useState} from 'preact/hooks';
import {type Point, simplified} from '../model/scene_yaml';

export interface Outline {
  id: string;
  name: string;
  kind: 'organ' | 'attachment' | 'focus' | 'label' | 'example';
  points: Point[];
}

interface Props {
  image: string;
  width: number;
  height: number;
  outlines: Outline[];
  /** The one whose corners can be moved. */
  active: string;
  /** What a press on the picture begins: nothing, corners one by one, a line by hand, or one place. */
  tool: 'none' | 'polygon' | 'lasso' | 'point';
  /** An outline was drawn or changed; of a tool the active one. */
  change: (id: string, points: Point[]) => void;
}

const kClose_px = 9, kLassoNear_px = 2.5;

/** The left image with outlines whose corners move, by pointer or by arrow keys. */
export function Drawing({image, width, height, outlines, active, tool, change}: Props) {
  const svg = useRef<SVGSVGElement>(null);
  const [draft, showDraft] = useState<Point[]>([]);
  // Presses may come faster than the page is drawn.
  const newest = useRef<Point[]>([]);
  const setDraft = (points: Point[]) => {
    newest.current = points;
    showDraft(points);
  };
  const [hover, setHover] = useState<Point | null>(null);
  const [moved, setMoved] = useState<{id: string; points: Point[]} | null>(null);
  useEffect(() => setDraft([]), [tool, active]);

  const place = (event: PointerEvent): Point => {
    const box = svg.current!.getBoundingClientRect();
    const clamp = (value: number, most: number) => Math.min(most - 1, Math.max(0, value));
    return [clamp(((event.clientX - box.left) / box.width) * width, width), clamp(((event.clientY - box.top) / box.height) * height, height)];
  };
  const scale = () => width / (svg.current?.getBoundingClientRect().width || width);
  const finish = (points: Point[]) => {
    setDraft([]);
    if (points.length >= 3) change(active, points);
  };

  const press = (event: PointerEvent) => {
    if (tool === 'none' || event.button !== 0) return;
    const at = place(event);
    if (tool === 'point') return change(active, [at]);
    if (tool === 'polygon') {
      const corners = newest.current, first = corners[0];
      if (corners.length >= 3 && first && Math.hypot(at[0] - first[0], at[1] - first[1]) < kClose_px * scale()) return finish(corners);
      return setDraft([...corners, at]);
    }
    const line: Point[] = [at];
    const move = (next: PointerEvent) => {
      line.push(place(next));
      setDraft([...line]);
    };
    const up = () => {
      removeEventListener('pointermove', move);
      removeEventListener('pointerup', up);
      finish(simplified(line, kLassoNear_px));
    };
    addEventListener('pointermove', move);
    addEventListener('pointerup', up);
  };

  const drag = (outline: Outline, index: number) => (event: PointerEvent) => {
    event.stopPropagation();
    if (event.altKey && outline.points.length > 3) return change(outline.id, outline.points.filter((_, i) => i !== index));
    let points = outline.points;
    const move = (next: PointerEvent) => {
      points = outline.points.map((point, i) => (i === index ? place(next) : point));
      setMoved({id: outline.id, points});
    };
    const up = () => {
      removeEventListener('pointermove', move);
      removeEventListener('pointerup', up);
      setMoved(null);
      if (points !== outline.points) change(outline.id, points);
    };
    addEventListener('pointermove', move);
    addEventListener('pointerup', up);
  };

  const keyOnCorner = (outline: Outline, index: number) => (event: KeyboardEvent) => {
    const step = event.shiftKey ? 10 : 1;
    const by: {[key: string]: Point} = {ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step]};
    const shift = by[event.key];
    if (shift) {
      event.preventDefault();
      change(outline.id, outline.points.map((p, i) => (i === index ? [p[0] + shift[0], p[1] + shift[1]] : p)));
    } else if (event.key === 'Delete' && outline.points.length > 3) {
      change(outline.id, outline.points.filter((_, i) => i !== index));
    }
  };

  /** One more corner in the middle of a side. */
  const split = (outline: Outline, index: number, event: PointerEvent) => {
    if (tool !== 'none') return;
    event.stopPropagation();
    change(outline.id, [...outline.points.slice(0, index + 1), place(event), ...outline.points.slice(index + 1)]);
  };

  useEffect(() => {
    const press = (event: KeyboardEvent) => {
      if (event.target instanceof HTMLElement && event.target.matches('input, select, textarea')) return;
      if (event.key === 'Enter' && newest.current.length >= 3) finish(newest.current);
      if (event.key === 'Escape') setDraft([]);
    };
    addEventListener('keydown', press);
    return () => removeEventListener('keydown', press);
  });

  const list = (points: Point[]) => points.map((point) => point.join(',')).join(' ');
  return (
    <svg
      ref={svg}
      class={`drawing tool-${tool}`}
      viewBox={`0 0 ${width} ${height}`}
      onPointerDown={press}
      onPointerMove={(event) => setHover(place(event))}
      onDblClick={() => newest.current.length >= 3 && finish(newest.current)}
      aria-label="left image with the outlines of the scene"
      role="group"
    >
      <image href={image} width={width} height={height} />
      {outlines.map((outline) => {
        const points = moved?.id === outline.id ? moved.points : outline.points;
        const isActive = outline.id === active;
        if (outline.kind === 'example') return points.map(([x, y]) => <circle key={outline.id} class="example" cx={x} cy={y} r="8" />);
        return (
          <g key={outline.id} class={`outline ${outline.kind} ${isActive ? 'active' : ''}`}>
            <polygon points={list(points)} />
            {isActive &&
              points.map((point, i) => {
                const next = points[(i + 1) % points.length]!;
                return <line key={`s${i}`} x1={point[0]} y1={point[1]} x2={next[0]} y2={next[1]} onDblClick={(e) => split(outline, i, e as unknown as PointerEvent)} />;
              })}
            {isActive &&
              points.map(([x, y], i) => (
                <circle key={i} cx={x} cy={y} r={5 * Math.max(1, width / 1000)} tabIndex={0} role="button" aria-label={`corner ${i + 1} of ${outline.name}`} onPointerDown={drag(outline, i)} onKeyDown={keyOnCorner(outline, i)} />
              ))}
          </g>
        );
      })}
      {draft.length > 0 && (
        <g class="draft">
          <polyline points={list(tool === 'polygon' && hover ? [...draft, hover] : draft)} />
          {tool === 'polygon' && draft.map(([x, y], i) => <circle key={i} cx={x} cy={y} r="4" />)}
        </g>
      )}
    </svg>
  );
}
