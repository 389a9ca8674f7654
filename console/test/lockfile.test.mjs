// Debian 12 brings Node 18: every package must run on it. No package may name the host that it came from.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';

const kDebianNode = [18, 19, 0];

function compare(a, b) {
  for (let i = 0; i < 3; ++i) if ((a[i] ?? 0) !== (b[i] ?? 0)) return (a[i] ?? 0) - (b[i] ?? 0);
  return 0;
}

/** One comparison of a range: ">=18.0.0", "^18.12", "18.x", "*". */
function holds(version, comparison) {
  const found = /^(>=|>|<=|<|\^|~|=)?v?(\d+|[*xX])(?:\.(\d+|[*xX]))?(?:\.(\d+|[*xX]))?/.exec(comparison);
  if (!found) throw new Error(`the range '${comparison}' is not understood`);
  const [, sign = '', ...parts] = found;
  const numbers = parts.filter((part) => part !== undefined && /^\d+$/.test(part)).map(Number);
  const order = compare(version, numbers);
  switch (sign) {
    case '>=': return order >= 0;
    case '>': return order > 0;
    case '<=': return order <= 0;
    case '<': return order < 0;
    case '^': return order >= 0 && version[0] === numbers[0];
    case '~': return order >= 0 && version[0] === numbers[0] && version[1] === (numbers[1] ?? version[1]);
    default: return numbers.every((number, i) => number === version[i]);
  }
}

const allows = (version, range) =>
  range.split('||').some((part) => part.trim().replace(/([<>=^~]) +/g, '$1').split(/\s+/).every((one) => holds(version, one)));

assert(allows(kDebianNode, '^18.0.0 || ^20.0.0 || >=22.0.0'));
assert(allows(kDebianNode, '>= 14.17') && allows(kDebianNode, '*') && allows(kDebianNode, '^10 || >=15.0.1'));
assert(!allows(kDebianNode, '>=20') && !allows(kDebianNode, '^20.19.0 || >=22.12.0') && !allows(kDebianNode, '>=16 <18'));

const lock = JSON.parse(readFileSync(new URL('../package-lock.json', import.meta.url), 'utf8'));
for (const [name, entry] of Object.entries(lock.packages)) {
  assert(!('resolved' in entry), `${name} names the host it came from`);
  const range = entry.engines?.node;
  assert(!range || allows(kDebianNode, range), `${name} ${entry.version} needs Node ${range}, and Debian 12 has 18`);
}
console.log(`lock file: ${Object.keys(lock.packages).length} packages run on Node 18 and name no host`);
