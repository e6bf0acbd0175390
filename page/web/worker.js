// Runs the WebAssembly: one request at a time, whose files and answer are bytes in its memory.

/** Time between two looks for messages, in ms. */
const LOOK_MS = 100;
/** Whether this browser can suspend WebAssembly, so that messages arrive while a request is computed. */
const SUSPENDS = "Suspending" in WebAssembly;

/** @type {WebAssembly.Exports} */
let engine;
/** The request that is computed, the one whose best answer so far is wanted, and the time of the last look for messages. */
let current = 0;
let wanted;
let looked = 0;

const encoder = new TextEncoder();
const decoder = new TextDecoder();

/** The text at an address of the engine's memory. */
function textAt(address, length) {
  return decoder.decode(new Uint8Array(engine.memory.buffer, address, length));
}

/** Copies bytes into the engine's memory, which then owns them; returns their address. */
function give(bytes) {
  const address = engine.page_alloc(bytes.length);
  new Uint8Array(engine.memory.buffer, address, bytes.length).set(bytes);
  return address;
}

/** Lets messages arrive; returns whether the best answer so far is wanted. */
async function look() {
  await new Promise((resolve) => setTimeout(resolve));
  looked = performance.now();
  return wanted === current ? 1 : 0;
}

/** Instantiates the engine from its gzip-compressed bytes in base 64. */
async function start(base64) {
  const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = await new Response(stream).arrayBuffer();
  const page = {
    progress: (address, length) =>
      postMessage({ id: current, progress: JSON.parse(textAt(address, length)) }),
    due: () => (SUSPENDS && performance.now() - looked > LOOK_MS ? 1 : 0),
    look: SUSPENDS ? new WebAssembly.Suspending(look) : () => 0,
    panicked: (address, length) => postMessage({ id: current, panicked: textAt(address, length) }),
  };
  const { instance } = await WebAssembly.instantiate(bytes, { page });
  engine = instance.exports;
}

/** Computes one request; returns the parsed answer. */
async function call(request, files) {
  const bytes = encoder.encode(JSON.stringify(request));
  const compute = SUSPENDS ? WebAssembly.promising(engine.page_call) : engine.page_call;
  const packed = await compute(give(bytes), bytes.length, give(files), files.length);
  const [address, length] = [Number(packed >> 32n), Number(packed & 0xffffffffn)];
  const text = textAt(address, length);
  engine.page_free(address, length);
  return JSON.parse(text);
}

let started;
let last = Promise.resolve();

async function answer({ id, request, files }) {
  try {
    await started;
    current = id;
    postMessage({ id, answer: await call(request, new Uint8Array(files)) });
  } catch (error) {
    postMessage({ id, failed: String(error) });
  }
}

onmessage = ({ data }) => {
  if (data.base64) started = start(data.base64);
  else if (data.stop) wanted = data.stop;
  else last = last.then(() => answer(data));
};
