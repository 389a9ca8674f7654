import {useEffect, useRef, useState} from 'preact/hooks';
import * as THREE from 'three';
import {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';
import type {Shape} from '../model/shape';

export type Colouring = 'stress' | 'flags';

interface Props {
  shape: Shape | null;
  colouring: Colouring;
  tip_mm?: [number, number, number] | undefined;
  force_N?: [number, number, number] | undefined;
}

/** Of the greatest force so far. */
const kLongestArrow_mm = 25;
const kTissue = new THREE.Color('#c08a84');
const kFixed = new THREE.Color('#e0872e'), kNotSeen = new THREE.Color('#5b6b86'), kSeen = new THREE.Color('#57b8a5');
// Viridis at five places, as the overlay has it.
const kViridis = ['#440154', '#3b528b', '#21918c', '#5ec962', '#fde725'].map((hex) => new THREE.Color(hex));

function viridis(fraction: number): THREE.Color {
  const at = Math.min(1, Math.max(0, fraction)) * (kViridis.length - 1), below = Math.min(Math.floor(at), kViridis.length - 2);
  return kViridis[below]!.clone().lerp(kViridis[below + 1]!, at - below);
}

/** Stress as in the overlay: none leaves the tissue as it is. */
function coloursOf(shape: Shape, colouring: Colouring, max_kPa: number): Float32Array {
  const colours = new Float32Array(shape.positions_mm.length);
  for (let i = 0; i < shape.flags.length; ++i) {
    const flags = shape.flags[i]!;
    const fraction = shape.stress_kPa[i]! / max_kPa;
    const colour = colouring === 'stress' ? kTissue.clone().lerp(viridis(fraction), Math.min(1, 4 * fraction)) : flags & 1 ? kFixed : flags & 2 ? kNotSeen : kSeen;
    colour.toArray(colours, 3 * i);
  }
  return colours;
}

/** All that the view holds between drawings. */
class Stage {
  readonly renderer: THREE.WebGLRenderer;
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(40, 1, 1, 2000);
  readonly controls: OrbitControls;
  readonly plane = new THREE.Plane(new THREE.Vector3(0, 0, 1), 1e6);
  readonly tip = new THREE.Mesh(new THREE.SphereGeometry(1, 16, 12), new THREE.MeshBasicMaterial({color: '#ff5d5d'}));
  readonly arrow = new THREE.ArrowHelper(new THREE.Vector3(0, 0, 1), new THREE.Vector3(), 10, '#ff5d5d', 4, 2.4);
  private body: THREE.Mesh | null = null;
  private edges: THREE.LineSegments | null = null;
  private isFramed = false;
  /** The highest so far, so that colours keep their meaning. */
  private max_kPa = 1e-9;
  private max_N = 1e-3;

  constructor(host: HTMLElement) {
    this.renderer = new THREE.WebGLRenderer({antialias: true, alpha: true, preserveDrawingBuffer: true});
    this.renderer.localClippingEnabled = true;
    host.append(this.renderer.domElement);
    // The camera's own axes: x right, y down, z into the picture.
    this.camera.up.set(0, -1, 0);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener('change', () => this.draw());
    this.scene.add(new THREE.HemisphereLight('#ffffff', '#4a5560', 2.2));
    const light = new THREE.DirectionalLight('#ffffff', 1.4);
    light.position.set(-40, -60, -80);
    this.scene.add(light, this.tip, this.arrow);
    this.tip.visible = this.arrow.visible = false;
  }

  fit(host: HTMLElement) {
    const width = host.clientWidth || 300, height = host.clientHeight || 200;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  show(shape: Shape | null, colouring: Colouring) {
    for (const old of [this.body, this.edges]) {
      if (!old) continue;
      this.scene.remove(old);
      old.geometry.dispose();
      (old.material as THREE.Material).dispose();
    }
    this.body = this.edges = null;
    if (!shape) return this.draw();
    this.max_kPa = shape.stress_kPa.reduce((a, b) => Math.max(a, b), this.max_kPa);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(shape.positions_mm, 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(coloursOf(shape, colouring, this.max_kPa), 3));
    geometry.setIndex(new THREE.BufferAttribute(shape.triangles, 1));
    geometry.computeVertexNormals();
    const clipping = {clippingPlanes: [this.plane]};
    this.body = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({vertexColors: true, side: THREE.DoubleSide, roughness: 0.8, flatShading: true, ...clipping}));
    this.edges = new THREE.LineSegments(new THREE.WireframeGeometry(geometry), new THREE.LineBasicMaterial({color: '#0b1116', transparent: true, opacity: 0.35, ...clipping}));
    this.scene.add(this.body, this.edges);
    if (!this.isFramed) this.frame(geometry);
    this.draw();
  }

  /** Looks at the body from where the endoscope is, a little from aside. */
  frame(geometry: THREE.BufferGeometry) {
    geometry.computeBoundingSphere();
    const ball = geometry.boundingSphere!;
    this.controls.target.copy(ball.center);
    this.camera.position.copy(ball.center).add(new THREE.Vector3(-0.9, -1.1, -2.2).multiplyScalar(ball.radius * 1.15));
    this.controls.update();
    this.isFramed = true;
  }

  point(tip: [number, number, number] | undefined, force: [number, number, number] | undefined) {
    this.tip.visible = !!tip;
    if (tip) this.tip.position.set(...tip);
    const f = new THREE.Vector3(...(force ?? [0, 0, 0]));
    this.max_N = Math.max(this.max_N, f.length());
    const length = (kLongestArrow_mm * f.length()) / this.max_N;
    this.arrow.visible = !!tip && length > 0.5;
    if (tip && this.arrow.visible) {
      this.arrow.setDirection(f.clone().normalize());
      this.arrow.setLength(length, Math.min(4, length * 0.4), Math.min(2.4, length * 0.25));
      this.arrow.position.set(...tip);
    }
    this.draw();
  }

  /** Cuts away what lies nearer than this fraction of the depth. */
  cut(fraction: number) {
    const ball = this.body?.geometry.boundingSphere;
    if (!ball) return;
    this.plane.constant = fraction <= 0 ? 1e6 : -(ball.center.z - ball.radius + 2 * ball.radius * fraction);
    this.draw();
  }

  draw() {
    this.renderer.render(this.scene, this.camera);
  }

  dispose() {
    this.show(null, 'flags');
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }
}

/** The body in 3D: turned with the mouse or a finger, cut by a plane. */
export default function View3d({shape, colouring, tip_mm, force_N}: Props) {
  const host = useRef<HTMLDivElement>(null);
  const stage = useRef<Stage | null>(null);
  const [isMissing, setIsMissing] = useState(false);
  const [section, setSection] = useState(0);
  useEffect(() => {
    try {
      stage.current = new Stage(host.current!);
    } catch {
      setIsMissing(true);
      return;
    }
    const made = stage.current, place = host.current!, fit = new ResizeObserver(() => made.fit(place));
    fit.observe(place);
    return () => {
      fit.disconnect();
      made.dispose();
      stage.current = null;
    };
  }, []);
  useEffect(() => {
    stage.current?.show(shape, colouring);
    stage.current?.cut(section);
  }, [shape, colouring]);
  useEffect(() => stage.current?.point(tip_mm, force_N), [tip_mm?.join(), force_N?.join()]);
  useEffect(() => stage.current?.cut(section), [section]);
  if (isMissing) return <p class="hint">This browser shows no 3D (WebGL is off).</p>;
  return (
    <div class="view3d">
      <div class="stage" ref={host} />
      <label class="section">
        section
        <input type="range" min="0" max="1" step="0.01" value={section} onInput={(e) => setSection(Number(e.currentTarget.value))} />
      </label>
      {colouring === 'flags' && (
        <p class="legend">
          <span class="seen">seen</span> <span class="not-seen">not seen</span> <span class="fixed">fixed</span>
        </p>
      )}
    </div>
  );
}
