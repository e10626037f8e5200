// A histogram on a canvas.

/** `bins` are { begin, width, counts }. */
export function drawHistogram(canvas, { counts }) {
  const { width, height } = canvas;
  const context = canvas.getContext("2d");
  context.clearRect(0, 0, width, height);
  const most = Math.max(...counts);
  context.fillStyle = "#7df0b0";
  const wide = width / counts.length;
  for (const [i, count] of counts.entries()) {
    // What is not empty is seen.
    const high = count === 0 ? 0 : Math.max((count / most) * height, 1);
    context.fillRect(i * wide, height - high, Math.max(wide - (wide > 3 ? 1 : 0), 1), high);
  }
}

/** What a histogram shows, in words. */
export function histogramText({ begin, width, counts }, textOf) {
  const most = Math.max(...counts);
  const at = counts.indexOf(most);
  const [from, to] = [begin + at * width, begin + (at + 1) * width].map(textOf);
  return `Histogram of ${counts.length} bins; the fullest one has ${most} samples from ${from} to ${to}`;
}
