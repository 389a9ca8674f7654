// From a scene to a force by the keyboard alone; what has the focus can be seen.
//   PALPATE_PROGRAM=build/release/bin/palpate PALPATE_DEMO=out/demo/recording node console/test/keyboard.test.mjs
import assert from 'node:assert/strict';
import {cpSync, mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {chromium} from 'playwright-core';
import {startConsole} from './program.mjs';

const demo = process.env.PALPATE_DEMO;
const kLong = {timeout: 180_000};  // an upper end for a machine that is busy, not a demand
const root = mkdtempSync(join(tmpdir(), 'palpate_keyboard_'));
for (const name of ['left.mp4', 'right.mp4', 'calibration.yaml', 'scene.yaml']) cpSync(join(demo, name), join(root, name));

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--headless', '--no-sandbox', '--disable-background-networking', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
const server = await startConsole(root);
const page = await (await browser.newContext({viewport: {width: 1280, height: 800}})).newPage();
page.setDefaultTimeout(60_000);

/** What has the focus: its name as it is read out, and whether anything shows that it has it. */
const focused = () =>
  page.evaluate(() => {
    const at = document.activeElement;
    if (!at || at === document.body) return null;
    const label = at.getAttribute('aria-label') ?? at.labels?.[0]?.textContent ?? at.textContent ?? '';
    const style = getComputedStyle(at), line = at.querySelector?.('line:last-child');
    const isShown = style.outlineStyle !== 'none' || at.matches('circle:focus-visible') || (line && getComputedStyle(line).strokeWidth === '4px');
    return {name: label.trim(), tag: at.tagName, isShown: Boolean(isShown)};
  });

/** Presses Tab until the element with this name has the focus. */
async function reach(name) {
  const passed = [];
  for (let i = 0; i < 400; ++i) {
    await page.keyboard.press('Tab');
    const at = await focused();
    if (!at) continue;
    assert(at.isShown, `the focus on ${at.tag} '${at.name}' cannot be seen`);
    if (name.test(at.name)) return;
    passed.push(at.name);
  }
  throw new Error(`Tab never reaches ${name}; it passes ${[...new Set(passed)].join(' | ')}`);
}

async function press(name) {
  await reach(name);
  await page.keyboard.press('Enter');
}

try {
  await page.goto(server.address);
  await page.getByText('From a recording to a force').waitFor();
  await press(/scene\.yaml/);
  await page.locator('.phase', {hasText: 'ready'}).waitFor();
  await press(/^Build$/);
  await press(/Build the map/);
  await page.getByText('Go on to the run').waitFor(kLong);
  await press(/Go on to the run/);
  await press(/Run and record/);
  await page.getByText('Ran to the end').waitFor(kLong);
  await press(/^Replay$/);
  await page.locator('.scrub').waitFor();
  await reach(/frame|moment|time/i);
  await page.keyboard.press('End');
  console.log('ok  from a scene to a force and back by the keyboard alone');
} catch (error) {
  await page.screenshot({path: join(tmpdir(), 'palpate_keyboard_fault.png')}).catch(() => undefined);
  console.error(`${error.stack}\nwhat was seen: ${join(tmpdir(), 'palpate_keyboard_fault.png')}`);
  process.exitCode = 1;
} finally {
  await browser.close();
  await server.stop();
  rmSync(root, {recursive: true, force: true});
}
