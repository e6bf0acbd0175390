// A worker with the WebAssembly, made from texts in this page, so that the page also works from a disk.

/** The worker's script and the engine, as the build puts them into the page. */
const SCRIPT = () => document.getElementById("worker").textContent;
const ENGINE = () => window.vsjEngine;

/** Thrown to whoever waits for a request that was cancelled. */
export class Cancelled extends Error {}

/** Sends requests to a worker of its own. A new request waits for the one before. */
export class Engine {
  #worker;
  #waiting = new Map();
  #last = 0;

  #start() {
    const url = URL.createObjectURL(new Blob([SCRIPT()], { type: "text/javascript" }));
    this.#worker = new Worker(url);
    URL.revokeObjectURL(url);
    this.#worker.onmessage = ({ data }) => this.#receive(data);
    this.#worker.onerror = (event) => this.#end(new Error(`The worker stopped: ${event.message}`));
    this.#worker.postMessage({ base64: ENGINE() });
  }

  #receive({ id, progress, answer, failed, panicked }) {
    const request = this.#waiting.get(id);
    if (progress) return request?.onProgress?.(progress);
    if (panicked) return this.#end(new Error(`This is a bug of the page: ${panicked}`));
    if (failed) return this.#end(new Error(`The engine stopped: ${failed}`));
    this.#waiting.delete(id);
    if (answer.error) request?.reject(new Error(answer.error));
    else request?.resolve(answer.ok);
  }

  /** Ends the worker: all that wait for it get the error. */
  #end(error) {
    this.#worker?.terminate();
    this.#worker = undefined;
    for (const { reject } of this.#waiting.values()) reject(error);
    this.#waiting.clear();
  }

  /** The answer to a request about the bytes of files; `onProgress` receives reports on the way. */
  ask(request, { files = new ArrayBuffer(0), onProgress } = {}) {
    if (!this.#worker) this.#start();
    const id = ++this.#last;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject, onProgress });
      this.#worker.postMessage({ id, request, files });
    });
  }

  /** Asks for the best answer so far. Returns false where the browser cannot suspend WebAssembly to hear of it. */
  stop() {
    for (const id of this.#waiting.keys()) this.#worker.postMessage({ stop: id });
    return "Suspending" in WebAssembly;
  }

  /** Ends what is computed, without an answer; the next request starts a new worker. */
  cancel() {
    this.#end(new Cancelled("cancelled"));
  }
}
