import {useEffect, useState} from 'preact/hooks';
import {useLive} from './model/hooks';
import {BuildPanel} from './panels/build_panel';
import {ReplayPanel} from './panels/replay_panel';
import {RunPanel} from './panels/run_panel';
import {ScenePanel} from './panels/scene_panel';
import {SourcePanel} from './panels/source_panel';

const kPanels = {
  source: {name: 'Source', needs: 'nothing', show: () => <SourcePanel />},
  scene: {name: 'Scene', needs: 'source', show: () => <ScenePanel />},
  build: {name: 'Build', needs: 'source', show: () => <BuildPanel />},
  run: {name: 'Run', needs: 'map', show: () => <RunPanel />},
  replay: {name: 'Replay', needs: 'nothing', show: () => <ReplayPanel />},
} as const;
type PanelName = keyof typeof kPanels;

const kPhases = {idle: 'no scene', ready: 'ready', building: 'building', running: 'running', failed: 'failed'};

function panelOfAddress(): PanelName {
  const name = location.hash.slice(1);
  return name in kPanels ? (name as PanelName) : 'source';
}

function Lost({since}: {since: number}) {
  return (
    <div class="banner lost" role="alert">
      <strong>The program does not answer.</strong> What is shown is of {Math.round((performance.now() - since) / 1000)} s
      ago; the page connects by itself when the program is back.
    </div>
  );
}

/** Dark, unless this computer or its user prefers light. */
function useTheme(): [string, () => void] {
  const [theme, setTheme] = useState(
    localStorage.getItem('theme') ?? (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark'),
  );
  document.documentElement.dataset['theme'] = theme;
  const change = () => {
    const next = theme === 'dark' ? 'light' : 'dark';
    localStorage.setItem('theme', next);
    setTheme(next);
  };
  return [theme, change];
}

export function App() {
  const state = useLive();
  const [theme, changeTheme] = useTheme();
  const [panel, setPanel] = useState<PanelName>(panelOfAddress());
  useEffect(() => {
    const follow = () => setPanel(panelOfAddress());
    addEventListener('hashchange', follow);
    return () => removeEventListener('hashchange', follow);
  }, []);
  const has = {nothing: true, source: !!state.source, map: !!state.map || !!state.run};
  return (
    <>
      <header>
        <h1>Palpate</h1>
        <nav aria-label="steps">
          {(Object.keys(kPanels) as PanelName[]).map((name) => (
            <a
              key={name}
              href={`#${name}`}
              class={has[kPanels[name].needs] ? '' : 'later'}
              aria-current={panel === name ? 'page' : undefined}
            >
              {kPanels[name].name}
            </a>
          ))}
        </nav>
        <span class="scene-name" title={state.scene?.file}>
          {state.scene ? state.scene.file : ''}
          {state.scene && !state.scene.saved ? ' (not saved)' : ''}
        </span>
        <span class={`phase ${state.connected ? state.phase : 'failed'}`} role="status">
          {state.connected ? kPhases[state.phase] : 'no connection'}
        </span>
        <button class="small" onClick={changeTheme} aria-label={`${theme === 'dark' ? 'light' : 'dark'} colours`}>
          {theme === 'dark' ? '☀' : '☾'}
        </button>
      </header>
      {!state.connected && state.lostSince !== null && state.scene && <Lost since={state.lostSince} />}
      {state.phase === 'failed' && state.sentence && (
        <div class="banner" role="alert">
          {state.sentence}
        </div>
      )}
      <main class={state.connected ? '' : 'greyed'}>{kPanels[panel].show()}</main>
      <footer>Research software, not a medical device. Forces hold for the stated tissue only.</footer>
    </>
  );
}
