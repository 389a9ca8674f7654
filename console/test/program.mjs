// The program under test, and people who speak to it without a browser.
import {spawn, spawnSync} from 'node:child_process';
import {readFileSync} from 'node:fs';
import http from 'node:http';
import net from 'node:net';

export const program = process.env.PALPATE_PROGRAM;

/** Runs a verb of the terminal to its end. */
export function run(...words) {
  const outcome = spawnSync(program, words, {encoding: 'utf8'});
  if (outcome.status !== 0) throw new Error(`palpate ${words.join(' ')}: ${outcome.status} ${outcome.stderr}`);
  return outcome.stdout;
}

/** A console below `root`; `port` 0 = any. */
export async function startConsole(root, port = 0, words = []) {
  const child = spawn(program, ['console', '--root', root, '--port', String(port), ...words], {stdio: ['ignore', 'pipe', 'inherit']});
  const address = await new Promise((resolve, reject) => {
    let text = '';
    child.on('exit', (code) => reject(new Error(`the console ended with ${code}`)));
    child.stdout.on('data', (part) => {
      text += part;
      const found = /console +(http:\S+)/.exec(text);
      if (found) resolve(found[1]);
    });
  });
  const ended = new Promise((resolve) => child.on('exit', resolve));
  return {
    address,
    port: Number(new URL(address).port),
    stop: (signal = 'SIGINT') => {
      child.kill(signal);
      return ended;
    },
  };
}

/** Status of a GET with these header lines. */
export function statusOf(port, path, headers) {
  return new Promise((resolve, reject) => {
    const request = http.get({port, path, headers}, (answer) => {
      answer.resume();
      resolve(answer.statusCode);
    });
    request.on('upgrade', (answer, socket) => {
      socket.destroy();
      resolve(answer.statusCode);
    });
    request.on('error', reject);
  });
}

export const upgrade = {
  Connection: 'Upgrade', Upgrade: 'websocket', 'Sec-WebSocket-Version': '13', 'Sec-WebSocket-Key': 'dGhlIHNhbXBsZSBub25jZQ==',
};

/** A viewer that asks for everything and never reads. */
export function stalledViewer(port) {
  const socket = net.connect(port, '127.0.0.1');
  socket.pause();
  const lines = Object.entries({Host: `127.0.0.1:${port}`, ...upgrade}).map(([name, value]) => `${name}: ${value}\r\n`);
  socket.write(`GET /live HTTP/1.1\r\n${lines.join('')}\r\n`);
  const text = Buffer.from('{"view":{"picture":true,"shape":true}}');
  socket.write(Buffer.concat([Buffer.from([0x81, 0x80 | text.length, 0, 0, 0, 0]), text]));
  return socket;
}

/** Rows of a forces.csv by frame. */
export function forcesOf(file) {
  const [head, ...lines] = readFileSync(file, 'utf8').trim().split('\n');
  const names = head.split(',');
  return new Map(lines.map((line) => {
    const row = Object.fromEntries(line.split(',').map((value, i) => [names[i], value]));
    return [Number(row.frame), row];
  }));
}

/** A viewer without a page (RFC 6455, unmasked frames in, masked ones out). */
export async function connect(port, view) {
  const socket = net.connect(port, '127.0.0.1');
  const lines = Object.entries({Host: `127.0.0.1:${port}`, ...upgrade}).map(([name, value]) => `${name}: ${value}\r\n`);
  socket.write(`GET /live HTTP/1.1\r\n${lines.join('')}\r\n`);
  const send = (message, opcode = 1) => {
    const text = Buffer.from(typeof message === 'string' ? message : JSON.stringify(message));
    const size = text.length < 126 ? Buffer.from([0x80 | text.length]) : Buffer.from([0x80 | 126, text.length >> 8, text.length & 255]);
    socket.write(Buffer.concat([Buffer.from([0x80 | opcode]), size, Buffer.alloc(4), text]));
  };
  const listeners = new Set();
  let bytes = Buffer.alloc(0), isOpen = false, opened;
  const ready = new Promise((resolve) => { opened = resolve; });
  const take = () => {
    if (!isOpen) {
      const end = bytes.indexOf('\r\n\r\n');
      if (end < 0) return;
      bytes = bytes.subarray(end + 4);
      isOpen = true;
      opened();
    }
    while (bytes.length >= 2) {
      const short = bytes[1] & 127, head = short < 126 ? 2 : short === 126 ? 4 : 10;
      if (bytes.length < head) return;
      const size = short < 126 ? short : short === 126 ? bytes.readUInt16BE(2) : Number(bytes.readBigUInt64BE(2));
      if (bytes.length < head + size) return;
      const opcode = bytes[0] & 15, content = bytes.subarray(head, head + size);
      bytes = bytes.subarray(head + size);
      if (opcode === 9) send(content.toString(), 10);
      if (opcode === 1) for (const listener of [...listeners]) listener(JSON.parse(content.toString()));
    }
  };
  socket.on('data', (part) => {
    bytes = bytes.length ? Buffer.concat([bytes, part]) : part;
    take();
  });
  socket.on('error', () => undefined);
  await ready;
  send({view});
  const until = (holds) =>
    new Promise((resolve) => {
      const listener = (message) => {
        if (!holds(message)) return;
        listeners.delete(listener);
        resolve(message);
      };
      listeners.add(listener);
    });
  let next = 1;
  return {
    until,
    close: () => socket.destroy(),
    ask: async (what, fields = {}) => {
      const id = next++;
      const reply = until((message) => message.reply === id);
      send({id, ask: what, ...fields});
      const {error} = await reply;
      if (error) throw new Error(error);
    },
  };
}
