// Runs the WebAssembly: one request at a time, whose file and answer are bytes in its memory.

/** @type {WebAssembly.Exports} */
let engine;
let current = 0;

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

/** Instantiates the engine from its gzip-compressed bytes in base 64. */
async function start(base64) {
  const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = await new Response(stream).arrayBuffer();
  const page = {
    progress: (address, length) =>
      postMessage({ id: current, progress: JSON.parse(textAt(address, length)) }),
    panicked: (address, length) => postMessage({ id: current, panicked: textAt(address, length) }),
  };
  const { instance } = await WebAssembly.instantiate(bytes, { page });
  engine = instance.exports;
}

/** Answers one request; returns the parsed answer. */
function call(request, file) {
  const bytes = encoder.encode(JSON.stringify(request));
  const packed = engine.page_call(give(bytes), bytes.length, give(file), file.length);
  const [address, length] = [Number(packed >> 32n), Number(packed & 0xffffffffn)];
  const text = textAt(address, length);
  engine.page_free(address, length);
  return JSON.parse(text);
}

let started;

onmessage = async ({ data }) => {
  try {
    if (data.base64) {
      started = start(data.base64);
      return;
    }
    await started;
    current = data.id;
    postMessage({ id: data.id, answer: call(data.request, new Uint8Array(data.file)) });
  } catch (error) {
    postMessage({ id: data.id, failed: String(error) });
  }
};
