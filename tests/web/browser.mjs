// Runs in the page. Reports what it found to the server; browser_test.mjs compares it with the program.
import { TagridError, open } from "/dist/index.js";

const plan = await (await fetch("/plan")).json();
const results = [];

async function digest(samples) {
  const hash = await crypto.subtle.digest("SHA-256", samples);
  return [...new Uint8Array(hash)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}

for (const { url, read, options = {}, abort, blob, volume: number } of plan) {
  const result = { url };
  const begin = performance.now();
  try {
    const source = blob ? await (await fetch(url)).blob() : url;
    let volume = await open(source, options);
    const first = volume;
    if (number) volume = await volume.volume(number);
    const controller = new AbortController();
    if (abort !== undefined) setTimeout(() => controller.abort(), abort);
    result.digest = await digest(await volume.read({ ...read, signal: controller.signal }));
    result.type = volume.type;
    first.close();
  } catch (error) {
    result.code = error instanceof TagridError ? error.code : error.name;
    result.message = String(error.stack);
  }
  result.ms = performance.now() - begin;
  results.push(result);
}

await fetch("/report", { method: "POST", body: JSON.stringify({ agent: navigator.userAgent, results }) });
