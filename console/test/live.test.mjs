// A live source on the page: two cameras, sent over loopback by GStreamer's own program, with a number in each picture.
//   PALPATE_PROGRAM=build/release/bin/palpate PALPATE_DEMO=out/demo/recording node console/test/live.test.mjs
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {cpSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import net from 'node:net';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {chromium} from 'playwright-core';
import {forcesOf, run, startConsole} from './program.mjs';

const demo = process.env.PALPATE_DEMO;
const shots = process.env.PALPATE_SHOTS;
const seconds = Number(process.env.PALPATE_LIVE_SECONDS ?? 20);
const kLong = {timeout: 180_000};  // an upper end for a machine that is busy, not a demand
const kStep_s = 0.04, kLoops = 5, kBits = 10, kSide_px = 16, kX_px = 720, kY_px = 470;

if (spawnSync('gst-inspect-1.0', ['--exists', 'gdppay']).status !== 0 || spawnSync('ffmpeg', ['-version']).status !== 0) {
  console.log('live: SKIPPED, as gst-launch-1.0, its plugins or ffmpeg are missing here');
  process.exit(0);
}

const root = mkdtempSync(join(tmpdir(), 'palpate_live_')), cameras = mkdtempSync(join(tmpdir(), 'palpate_cameras_'));
cpSync(join(demo, 'calibration.yaml'), join(root, 'calibration.yaml'));

/** The demo's pictures over and over, each with its number in squares. */
function paint(name) {
  const box = (x, colour, when) => `drawbox=x=${x}:y=${kY_px}:w=${kSide_px}:h=${kSide_px}:color=${colour}:t=fill${when}`;
  const bits = Array.from({length: kBits}, (_, bit) => bit).flatMap((bit) => [
    box(kX_px + kSide_px * bit, 'black', ''),
    box(kX_px + kSide_px * bit, 'white', `:enable='mod(floor(n/${2 ** bit}),2)'`),
  ]);
  const made = spawnSync('ffmpeg', ['-loglevel', 'error', '-stream_loop', String(kLoops - 1), '-i', join(demo, `${name}.mp4`),
    '-vf', bits.join(','), '-q:v', '2', '-start_number', '0', join(cameras, `${name}_%04d.jpg`)], {encoding: 'utf8'});
  assert.equal(made.status, 0, made.stderr);
}

const freePort = () =>
  new Promise((resolve) => {
    const server = net.createServer().listen(0, '127.0.0.1', () => {
      const {port} = server.address();
      server.close(() => resolve(port));
    });
  });

function send(ports) {
  const camera = (name, port) =>
    `multifilesrc location=${cameras}/${name}_%04d.jpg loop=true caps=image/jpeg,framerate=25/1 ! jpegdec ! identity sync=true ! gdppay ! tcpserversink host=127.0.0.1 port=${port} sync=false`;
  const child = spawn('gst-launch-1.0', ['-q', ...`${camera('left', ports[0])} ${camera('right', ports[1])}`.split(' ')], {stdio: 'ignore'});
  return {stop: () => new Promise((resolve) => { child.on('exit', resolve); child.kill('SIGKILL'); })};
}

const reach = async (port) => {
  while (!(await new Promise((resolve) => {
    const probe = net.connect(port, '127.0.0.1', () => { probe.destroy(); resolve(true); });
    probe.on('error', () => resolve(false));
  }))) await new Promise((resolve) => setTimeout(resolve, 50));
};

for (const name of ['left', 'right']) paint(name);
const numbers = forcesOf(join(demo, 'truth.csv')).size * kLoops;
const ports = [await freePort(), await freePort()];
let sender = send(ports);
await Promise.all(ports.map(reach));
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--headless', '--no-sandbox', '--disable-background-networking', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
const server = await startConsole(root, 0, ['--live']);
const faults = [];
const page = await (await browser.newContext({viewport: {width: 1280, height: 800}, colorScheme: 'dark'})).newPage();
page.setDefaultTimeout(60_000);
page.on('pageerror', (error) => faults.push(error.message));
const tab = (name) => page.locator('header nav').getByText(name, {exact: true}).click();
async function shot(name) {
  if (!shots) return;
  mkdirSync(shots, {recursive: true});
  await page.waitForTimeout(600);
  await page.screenshot({path: join(shots, `${name}.png`)});
}
async function step(name, work) {
  const start = Date.now();
  await work();
  console.log(`ok  ${name} (${((Date.now() - start) / 1000).toFixed(1)} s)`);
}
const quantile = (list, part) => [...list].sort((a, b) => a - b)[Math.floor(part * (list.length - 1))];

await page.addInitScript(() => {
  window.numberIn = (canvas, bits, side, left, top) => {
    const context = canvas.getContext('2d', {willReadFrequently: true});
    let number = 0;
    for (let bit = 0; bit < bits; ++bit)
      if (context.getImageData(left + side * bit + side / 2, top + side / 2, 1, 1).data[1] > 128) number |= 1 << bit;
    return number;
  };
  window.numberOfSource = async (...place) => {
    const answer = await fetch(`/api/source/left.jpg?picture=${performance.now()}`);
    const bitmap = await createImageBitmap(await answer.blob());
    const canvas = Object.assign(document.createElement('canvas'), {width: bitmap.width, height: bitmap.height});
    canvas.getContext('2d').drawImage(bitmap, 0, 0);
    return window.numberIn(canvas, ...place);
  };
});
// The demo's scene with a live source.
writeFileSync(join(root, 'live_scene.yaml'), readFileSync(join(demo, 'scene.yaml'), 'utf8')
  .replace('left: left.mp4', `left: tcpclientsrc host=127.0.0.1 port=${ports[0]} ! gdpdepay`)
  .replace('right: right.mp4', `right: tcpclientsrc host=127.0.0.1 port=${ports[1]} ! gdpdepay`));

try {
  await page.goto(server.address);
  await step('opens a live source by its pipelines, and shows it as it is', async () => {
    await page.getByLabel('live left').fill(`tcpclientsrc host=127.0.0.1 port=${ports[0]} ! gdpdepay`);
    await page.getByLabel('live right').fill(`tcpclientsrc host=127.0.0.1 port=${ports[1]} ! gdpdepay`);
    await page.getByRole('button', {name: 'Open live source'}).click();
    await page.locator('.drawing').waitFor();
    await tab('Source');
    await page.getByText('live, 25.00 frames/s').waitFor();
    const source = () => page.locator('.pair-picture img').getAttribute('src');
    const before = await source();
    await page.waitForFunction((old) => document.querySelector('.pair-picture img').getAttribute('src') !== old, before);
    await shot('live_source');
  });

  await step('says that the source is away, and that it is back', async () => {
    await sender.stop();
    await page.getByText('The source gives no pictures').waitFor();
    await shot('live_silent');
    sender = send(ports);
    await page.getByText('The source gives no pictures').waitFor({state: 'detached'});
  });

  await step('opens the scene of a live source, and builds the map of the present picture', async () => {
    await page.locator('.kind-scene button', {hasText: 'live_scene.yaml'}).click();
    await page.locator('.outline.organ').waitFor();
    await tab('Build');
    const build = page.getByRole('button', {name: 'Build the map'});
    await build.waitFor();
    // At rest, as in the demo's own scene: its first pictures.
    await page.evaluate(async ([length, bits, ...place]) => {
      for (let at = length; at > 8; at = Math.max(0, await window.numberOfSource(bits, ...place)) % length);
    }, [numbers / kLoops, kBits, kSide_px, kX_px, kY_px]);
    await build.click();
    await page.getByText('Go on to the run').waitFor(kLong);
    assert.equal(await page.locator('dt:text-is("from frame") + dd').textContent(), 'live');
  });

  const seen = [];
  await step(`runs for ${seconds} s and shows the frames that it says it shows`, async () => {
    await tab('Run');
    await page.evaluate((place) => {
      window.drawn = [];
      let last = '';
      const look = () => {
        const canvas = document.querySelector('.live-picture canvas');
        if (canvas?.dataset.frame !== undefined && canvas.dataset.frame !== last) {
          last = canvas.dataset.frame;
          window.drawn.push([Number(last), window.numberIn(canvas, ...place), Number(canvas.dataset.age)]);
        }
        requestAnimationFrame(look);
      };
      look();
    }, [kBits, kSide_px, kX_px, kY_px]);
    await page.getByRole('button', {name: 'Run and record'}).waitFor();
    await page.waitForTimeout(200);
    await page.keyboard.press('r');
    await page.getByRole('button', {name: 'Stop'}).waitFor();
    await page.keyboard.press('v');
    await page.getByText('Stop the video').waitFor();
    await page.waitForTimeout(1000 * Math.min(5, seconds / 4));
    await shot('live_run');
    await page.keyboard.press('v');
    await page.getByText('Record the video').waitFor();
    await page.waitForTimeout(1000 * Math.max(0, seconds - 5));
    await page.keyboard.press('r');
    await page.getByText('Ran to the end').waitFor(kLong);
    seen.push(...(await page.evaluate(() => window.drawn)));
    const rows = forcesOf(join(root, 'runs/live_scene/forces.csv'));
    assert(seen.length > 3, `only ${seen.length} frames were shown`);
    const span = numbers * kStep_s;
    const [first] = seen;
    for (const [frame, number] of seen) {
      // The number painted into the picture tells the moment that the row of this frame is of.
      const painted = ((number - first[1]) * kStep_s) % span;
      const told = Number(rows.get(frame).time_s) - Number(rows.get(first[0]).time_s);
      const off = (((painted - told) % span) + 1.5 * span) % span - span / 2;
      assert(Math.abs(off) < kStep_s / 2, `frame ${frame} shows picture ${number}, ${off.toFixed(3)} s off`);
    }
    const ages = seen.map(([, , age]) => age);
    const dropped = await page.getByTestId('dropped').textContent();
    console.log(`    ${seen.length} of ${rows.size} frames were drawn, ${dropped} dropped before that; from stamp to drawing ${quantile(ages, 0.5).toFixed(0)} ms median, ${quantile(ages, 0.9).toFixed(0)} ms for 90 % (a frame takes ${1000 * kStep_s} ms)`);
  });

  await step('the recorded video opens again, here and in the terminal', async () => {
    const checked = JSON.parse(run('check', join(root, 'recordings/live_scene/scene.yaml'), '--json'));
    assert(checked.recording.frames > 3, `${checked.recording.frames} frames`);
    assert.equal(checked.recording.frames_without_right_image, 0);
    await tab('Source');
    await page.locator('.files button', {hasText: 'recordings'}).click();
    await page.locator('.files .kind-folder button', {hasText: 'live_scene'}).click();
    await page.locator('.kind-scene button').click();
    await page.locator('.outline.organ').waitFor();
    await tab('Source');
    await page.getByText(/frames\/s, jitter/).waitFor();
    await shot('live_kept');
  });
  assert.deepEqual(faults, [], 'the page reported errors');
} catch (error) {
  await page.screenshot({path: join(tmpdir(), 'palpate_live_fault.png')}).catch(() => undefined);
  console.error(`${error.stack}\nwhat was seen: ${join(tmpdir(), 'palpate_live_fault.png')}; errors of the page: ${JSON.stringify(faults)}`);
  process.exitCode = 1;
} finally {
  await browser.close();
  await server.stop();
  await sender.stop();
  for (const folder of [root, cameras]) rmSync(folder, {recursive: true, force: true});
}
