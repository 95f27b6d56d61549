// Starts the page: unpacks its code, its planner and its models, all of which stand in the page itself.

/** Bytes of a part of the page that is packed. */
async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const part = (id) => document.getElementById(`remora-${id}`).textContent;
const text = (bytes) => new TextDecoder().decode(bytes);

/** What planning needs, unpacked when it is first asked for. */
async function planner() {
  const [worker, code] = await Promise.all([unpacked(part("worker")), unpacked(part("planner"))]);
  const bytes = ([integrator, model]) => [integrator, Uint8Array.from(atob(model), (letter) => letter.charCodeAt(0))];
  const models = Object.fromEntries(Object.entries(JSON.parse(part("models"))).map(bytes));
  return { worker: text(worker), code, models };
}

/** When all of the page has been read. */
const hasRead = new Promise((resolve) => document.addEventListener("DOMContentLoaded", resolve));

async function start() {
  const script = document.createElement("script");
  script.textContent = text(await unpacked(part("page")));
  await hasRead;
  document.head.append(script);
  window.remora = window.remoraPage.begin(JSON.parse(part("data")), planner);
}

start();
