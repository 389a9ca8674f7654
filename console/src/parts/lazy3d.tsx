import {useEffect, useState} from 'preact/hooks';
import type {ComponentProps, ComponentType} from 'preact';
import type View3d from './view3d';

/** three.js is large: it comes when the first 3D view opens. */
export function Lazy3d(props: ComponentProps<typeof View3d>) {
  const [View, setView] = useState<ComponentType<typeof props> | null>(null);
  useEffect(() => {
    void import('./view3d').then((module) => setView(() => module.default));
  }, []);
  return View ? <View {...props} /> : <p class="hint">3D is loading</p>;
}
