// The operator's way from a recording to a force, in a browser, against the program itself.
//   PALPATE_PROGRAM=build/release/bin/palpate PALPATE_DEMO=out/demo/recording node console/test/console.test.mjs
import assert from 'node:assert/strict';
import {cpSync, mkdirSync, mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {chromium} from 'playwright-core';
import {contrastFaults} from './contrast.mjs';
import {forcesOf, run, startConsole, stalledViewer, statusOf, upgrade} from './program.mjs';

const demo = process.env.PALPATE_DEMO;
const shots = process.env.PALPATE_SHOTS;
const kLong = {timeout: 180_000};  // an upper end for a machine that is busy, not a demand
const root = mkdtempSync(join(tmpdir(), 'palpate_console_'));
for (const name of ['left.mp4', 'right.mp4', 'calibration.yaml']) cpSync(join(demo, name), join(root, name));

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--headless', '--no-sandbox', '--disable-background-networking', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
let server = await startConsole(root);
const faults = [];

async function newViewer(options = {}) {
  const context = await browser.newContext({viewport: {width: 1280, height: 800}, colorScheme: 'dark', ...options});
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  page.on('pageerror', (error) => faults.push(error.message));
  page.on('console', (message) => {
    // What the browser itself says of a connection that is lost on purpose is no fault.
    if (message.type() === 'error' && !/ERR_CONNECTION_REFUSED|WebSocket connection|404/.test(message.text())) faults.push(message.text());
  });
  await page.goto(server.address);
  return page;
}

const page = await newViewer();
const tab = (name, on = page) => on.locator('header nav').getByText(name, {exact: true}).click();
async function shot(name, on = page) {
  if (!shots) return;
  mkdirSync(shots, {recursive: true});
  await on.waitForTimeout(600);
  await on.screenshot({path: join(shots, `${name}.png`)});
}
async function step(name, work) {
  const start = Date.now();
  await work();
  console.log(`ok  ${name} (${((Date.now() - start) / 1000).toFixed(1)} s)`);
}
const toTheEnd = (on = page) => on.getByText('Ran to the end').waitFor(kLong);
const begin = async (isRealtime) => {
  await page.getByLabel('at its own rate').setChecked(isRealtime);
  await page.getByRole('button', {name: 'Run and record'}).click();
  await page.getByRole('button', {name: 'Stop'}).waitFor();
};

try {
  await step('opens a recording that has no scene', async () => {
    await page.getByText('From a recording to a force').waitFor();
    await shot('welcome');
    await page.getByRole('button', {name: 'Open recording'}).click();
    await page.locator('.drawing').waitFor();
    await tab('Source');
    await page.getByText('5.00 mm', {exact: true}).waitFor();
    await page.waitForFunction(() => [...document.images].every((image) => image.complete && image.naturalWidth > 0));
    await shot('source');
  });

  await step('draws the organ, takes it back and draws it again', async () => {
    await tab('Scene');
    const picture = page.locator('.drawing');
    const box = await picture.boundingBox();
    const to = ([x, y]) => [box.x + (x / 960) * box.width, box.y + (y / 540) * box.height];
    const corners = [[251, 233], [253, 327], [302, 394], [391, 424], [519, 402], [636, 326], [594, 241], [489, 152], [410, 125], [321, 143]];
    const draw = async () => {
      await page.getByRole('button', {name: 'Polygon'}).click();
      for (const corner of corners) await page.mouse.click(...to(corner));
      await shot('drawing');
      await page.keyboard.press('Enter');
      await page.locator('.outline.organ').waitFor();
    };
    await draw();
    await page.getByRole('button', {name: 'Undo'}).click();
    await page.locator('.outline.organ').waitFor({state: 'detached'});
    await page.getByRole('button', {name: 'Redo'}).click();
    await page.locator('.outline.organ').waitFor();
    assert.equal(await page.locator('.outline.organ circle').count(), corners.length);
  });

  await step('says at once why a value is bad, and takes a good one', async () => {
    const thickness = page.locator('[id="key-map.thickness_mm"]');
    await thickness.fill('-3');
    await thickness.press('Enter');
    await page.getByText('map.thickness_mm is -3, expected 0 < x <= 500').waitFor();
    await shot('bad_value');
    await thickness.fill('28.6');
    await thickness.press('Enter');
    await page.locator('.field.bad').waitFor({state: 'detached'});
    await page.getByText('uterus 400 kPa').click();
    await page.getByText('Haouchine et al. 2018, section VII.B').waitFor();
    await page.locator('.attachments input[type=range]').fill('6');
    await page.getByText('depth 6.0 mm').waitFor();
    const elements = page.locator('[id="key-map.elements"]');
    await elements.fill('550');
    await elements.press('Enter');
    await page.waitForFunction(() => document.querySelector('.yaml')?.textContent.includes('elements: 550'));
    await shot('scene');
  });

  await step('builds the map', async () => {
    await tab('Build');
    await page.getByRole('button', {name: 'Build the map'}).click();
    await page.getByText('Go on to the run').waitFor(kLong);
    await page.locator('.stages li.done').nth(6).waitFor();
    await page.locator('.view3d canvas, main .hint').first().waitFor();
    await shot('build');
    await page.getByRole('button', {name: 'Preview'}).click();
    await shot('preview');
    await page.getByRole('button', {name: '3D'}).click();
  });

  const second = await newViewer();
  await step('runs to the end, and shows the forces that it writes', async () => {
    await tab('Run');
    await tab('Run', second);
    await page.evaluate(() => {
      window.seen = [];
      const look = () => {
        const reading = document.querySelector('[data-testid=force]');
        if (reading?.dataset.frame !== undefined) window.seen.push([Number(reading.dataset.frame), reading.textContent]);
        requestAnimationFrame(look);
      };
      look();
    });
    await begin(false);
    await page.locator('.lamp.ok').waitFor(kLong);
    await shot('run');
    await toTheEnd();
    await page.getByText('not live').waitFor();
    await shot('ended');
    const rows = forcesOf(join(root, 'runs/scene/forces.csv'));
    assert.equal(rows.size, 110);
    await page.waitForFunction(() => window.seen.some(([frame]) => frame === 109));
    const seen = await page.evaluate(() => window.seen);
    const frames = new Set(seen.map(([frame]) => frame));
    // How many are seen is a matter of the machine.
    assert(frames.size > 3, `only ${frames.size} frames were shown`);
    for (const [frame, text] of seen) {
      const row = rows.get(frame), isKnown = !['tool_lost', 'not_converged'].includes(row.status);
      assert.equal(text, isKnown ? Number(row.force_N).toFixed(2) : '–', `frame ${frame}`);
    }
    const peak = Math.max(...[...rows.values()].map((row) => Number(row.force_N)));
    assert(peak > 1, `the greatest force is ${peak} N`);
    console.log(`    ${frames.size} of ${rows.size} frames were seen, peak ${peak.toFixed(2)} N`);
  });

  await step('two viewers see the same, and one that comes late sees it all', async () => {
    await toTheEnd(second);
    const late = await newViewer();
    await tab('Run', late);
    await toTheEnd(late);
    for (const viewer of [second, late]) assert.equal(await viewer.getByTestId('frame').textContent(), '109 of 110');
    await late.waitForFunction(() => document.querySelector('.live-picture canvas').dataset.frame === '109');
    await late.context().close();
  });

  await step('replays picture, chart and shape of the same moment', async () => {
    await tab('Replay');
    const rows = [...forcesOf(join(root, 'runs/scene/forces.csv')).values()];
    const peak = rows.reduce((best, row, i) => (Number(row.force_N) > Number(rows[best].force_N) ? i : best), 0);
    await page.locator('.scrub input[max="109"]').fill(String(peak));
    await page.waitForFunction((text) => document.querySelector('[data-testid=force]').textContent === text, Number(rows[peak].force_N).toFixed(2));
    await page.locator(`.video img[alt="frame ${rows[peak].frame}"]`).waitFor();
    await shot('replay');
  });

  await step('replays a run of the terminal, shapes too', async () => {
    run('estimate', join(demo, 'scene.yaml'), '-o', join(root, 'by_terminal'), '--json');
    await tab('Source');
    await tab('Replay');
    await page.getByRole('combobox', {name: /^run/}).selectOption('by_terminal');
    const rows = [...forcesOf(join(root, 'by_terminal/forces.csv')).values()];
    await page.locator('.scrub input[max="109"]').fill('60');
    await page.waitForFunction((text) => document.querySelector('[data-testid=force]').textContent === text, Number(rows[60].force_N).toFixed(2));
    await page.locator(`.video img[alt="frame ${rows[60].frame}"]`).waitFor();
    assert(!(await page.getByText('kept no shapes').isVisible()));
  });

  await step('saves the scene, which the terminal and the page build again', async () => {
    await tab('Scene');
    await page.getByLabel('name of the scene file').fill('mine_scene.yaml');
    await page.getByRole('button', {name: 'Save'}).click();
    await page.getByText('saved as mine_scene.yaml').waitFor();
    const built = JSON.parse(run('map', join(root, 'mine_scene.yaml'), '-o', join(root, 'map'), '--json'));
    await tab('Source');
    await page.locator('.kind-scene button', {hasText: 'mine_scene.yaml'}).click();
    await page.locator('.outline.organ').waitFor();
    await tab('Build');
    await page.getByRole('button', {name: 'Build the map'}).click();
    await page.getByText('Go on to the run').waitFor(kLong);
    assert.equal(await page.locator('dt:text-is("tetrahedra") + dd').textContent(), String(built.counts.elements));
  });

  await step('a viewer that stalls holds nobody up, and keys do what they say', async () => {
    // A slow recording, so that there is time to press keys on any machine.
    await tab('Source');
    await page.locator('summary', {hasText: 'recording'}).click();
    await page.locator('[id="key-recording.fps"]').fill('2');
    await page.locator('[id="key-recording.fps"]').press('Enter');
    await page.locator('.scene-name', {hasText: '(not saved)'}).waitFor();
    await tab('Build');
    await page.getByText('The scene has changed since').waitFor();
    await page.getByRole('button', {name: 'Build again'}).click();
    await page.getByText('Go on to the run').waitFor(kLong);
    const stalled = [1, 2].map(() => stalledViewer(server.port));
    await tab('Run');
    await page.getByLabel('3D').check();
    await page.getByLabel('at its own rate').check();
    await page.keyboard.press('r');
    await page.getByRole('button', {name: 'Stop'}).waitFor();
    await page.waitForFunction(() => Number(document.querySelector('.live-picture canvas').dataset.frame) >= 3 && document.querySelector('.live-picture canvas').dataset.frame !== '109');
    await page.keyboard.press('m');
    await page.locator('.marks').getByText(/ s: mark/).waitFor();
    await page.keyboard.press('z');
    await page.locator('.marks').getByText('map built again from this frame').waitFor();
    if (shots) await page.locator('.lamp.ok').waitFor(kLong);
    await shot('run_3d');
    await page.keyboard.press('r');
    await page.getByText(/interrupted after frame \d+/).waitFor();
    for (const socket of stalled) socket.destroy();
    assert.match(readFileSync(join(root, 'runs/mine_scene/marks.csv'), 'utf8'), /map built again/);
  });

  await step('the surgeon’s view fills the screen with picture and gauge', async () => {
    await page.keyboard.press('f');
    await page.waitForFunction(() => document.fullscreenElement);
    await shot('surgeon');
    assert(!(await page.locator('.toolbar').isVisible()));
    await page.keyboard.press('f');
    await page.waitForFunction(() => !document.fullscreenElement);
  });

  await step('refuses a foreign origin and a wrong name', async () => {
    const host = {Host: `127.0.0.1:${server.port}`};
    assert.equal(await statusOf(server.port, '/', host), 200);
    assert.equal(await statusOf(server.port, '/live', {...host, ...upgrade}), 101);
    assert.equal(await statusOf(server.port, '/live', {...host, ...upgrade, Origin: 'http://evil.example'}), 403);
    assert.equal(await statusOf(server.port, '/api/files', {...host, Origin: 'http://evil.example'}), 403);
    assert.equal(await statusOf(server.port, '/', {Host: 'evil.example'}), 403);
  });

  await step('says that the program is gone, and comes back with it', async () => {
    const port = server.port;
    await server.stop('SIGKILL');
    await page.getByText('The program does not answer.').waitFor();
    await page.locator('.phase', {hasText: 'no connection'}).waitFor();
    await shot('lost');
    server = await startConsole(root, port);
    await page.getByText('The program does not answer.').waitFor({state: 'detached'});
    await page.locator('.phase', {hasText: 'no scene'}).waitFor();
  });

  await step('can be read: contrast in both colours, and on a tablet', async () => {
    await tab('Source');
    await page.locator('.kind-scene button', {hasText: 'mine_scene.yaml'}).click();
    await page.locator('.outline.organ').waitFor();
    for (const theme of ['dark', 'light']) {
      for (const name of ['Source', 'Scene', 'Build', 'Replay']) {
        await tab(name);
        await page.waitForTimeout(300);
        const found = await page.evaluate(contrastFaults);
        assert.deepEqual(found, [], `${name} in ${theme}`);
      }
      await page.getByRole('button', {name: /colours/}).click();
    }
    await page.setViewportSize({width: 820, height: 1180});
    for (const name of ['Source', 'Scene', 'Build', 'Replay']) {
      await tab(name);
      await page.waitForTimeout(300);
      const tooWide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      assert(tooWide <= 0, `${name} is ${tooWide} px too wide for a tablet`);
      await shot(`tablet_${name.toLowerCase()}`);
    }
  });
  assert.deepEqual(faults, [], 'the page reported errors');
} catch (error) {
  await page.screenshot({path: join(tmpdir(), 'palpate_console_fault.png')}).catch(() => undefined);
  console.error(`${error.stack}\nwhat was seen: ${join(tmpdir(), 'palpate_console_fault.png')}; errors of the page: ${JSON.stringify(faults)}`);
  process.exitCode = 1;
} finally {
  await browser.close();
  await server.stop();
  rmSync(root, {recursive: true, force: true});
}
