// A picture of views as a PNG file, with a caption: the name, the slice, the window and the bound.
import { lossText } from "./describe.js";
import { titleOf } from "./marks.js";
import { titleOfPlane } from "./plane_marks.js";
import { numberText } from "./numbers.js";

/** The lines below the picture of a view, of what `state` has. */
export function captionOf(view, state) {
  const { name, shades, scale, volume, isDifference } = state;
  const withUnit = (number) => `${numberText(number, 9)} ${scale.unit}`.trim();
  const [low, high] = [shades.low, shades.high];
  const shown = isDifference
    ? `colors from ${withUnit(-shades.end)} to ${withUnit(shades.end)}`
    : `window: level ${withUnit((low + high) / 2)}, width ${withUnit(high - low)} (${withUnit(low)} to ${withUnit(high)})`;
  const [title, notes] = (view.isPlane ? titleOfPlane : titleOf)(view, state);
  return [name, notes ? `${title} · ${notes}` : title, shown, lossText(volume, scale) || "samples are exact"];
}

/** A canvas with pictures next to each other, each above its caption: { canvas, lines }. */
export function composed(pictures) {
  const size = Math.round(14 * devicePixelRatio);
  const line = Math.round(size * 1.4);
  const highest = Math.max(...pictures.map(({ canvas }) => canvas.height));
  const most = Math.max(...pictures.map(({ lines }) => lines.length));
  const made = document.createElement("canvas");
  made.width = pictures.reduce((sum, { canvas }) => sum + canvas.width, 0) + (pictures.length - 1) * size;
  made.height = highest + most * line + size;
  const context = made.getContext("2d");
  context.fillStyle = "#000";
  context.fillRect(0, 0, made.width, made.height);
  context.fillStyle = "#f4f4f4";
  context.font = `${size}px system-ui, sans-serif`;
  let left = 0;
  for (const { canvas, lines } of pictures) {
    context.drawImage(canvas, left, 0);
    for (const [i, text] of lines.entries())
      context.fillText(text, left + size / 2, highest + (i + 1) * line, canvas.width - size);
    left += canvas.width + size;
  }
  return made;
}

/** Characters that are in names of files everywhere. */
const safe = (text) => text.replaceAll(/[^\p{L}\p{N}.-]+/gu, "-").replace(/^[-.]+/, "") || "picture";

/** Saves a canvas where the browser saves files. */
export async function save(canvas, name) {
  const blob = await new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
  if (!blob) throw new Error("the picture is too large for this browser");
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = `${safe(name)}.png`;
  link.click();
  // The browser needs it until it has begun to save.
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
