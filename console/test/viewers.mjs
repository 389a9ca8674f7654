// What viewers cost a run: the time per frame without any, and with five of which one stalls, in another process.
//   PALPATE_PROGRAM=... PALPATE_DEMO=... node console/test/viewers.mjs
import {cpSync, mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {connect, forcesOf, stalledViewer, startConsole} from './program.mjs';

const kRounds = 5;
const root = mkdtempSync(join(tmpdir(), 'palpate_viewers_'));
cpSync(process.env.PALPATE_DEMO, root, {recursive: true});
const server = await startConsole(root);
const operator = await connect(server.port, {picture: false, shape: false});
await operator.ask('open_scene', {file: 'scene.yaml'});
await operator.ask('build');

async function medianOfRun() {
  await operator.ask('start', {realtime: false});
  const run = await operator.until((state) => state.run && state.run.over);
  const times = [...forcesOf(join(root, run.run.folder, 'forces.csv')).values()].map((row) => Number(row.frame_ms)).sort((a, b) => a - b);
  return times[Math.floor(times.length / 2)];
}

const alone = [], watched = [];
for (let round = 0; round < kRounds; ++round) {
  alone.push(await medianOfRun());
  const viewers = await Promise.all(Array.from({length: 4}, () => connect(server.port, {picture: true, shape: true})));
  const stalled = stalledViewer(server.port);
  watched.push(await medianOfRun());
  for (const viewer of viewers) viewer.close();
  stalled.destroy();
}
const median = (list) => [...list].sort((a, b) => a - b)[Math.floor(list.length / 2)];
console.log(`time per frame, median of ${kRounds} runs: ${median(alone).toFixed(1)} ms alone, ${median(watched).toFixed(1)} ms with five viewers, one stalled`);
operator.close();
await server.stop();
rmSync(root, {recursive: true, force: true});
