// The volume in space: a surface of one value, the interfaces of materials, or a fog as bright as the window says. A program of the graphics card
// follows a ray for each pixel through a texture with samples of an overview.
import { colorIn, mapPixels } from "./color_maps.js";
import { followPointers, wheelZoom } from "./gestures.js";
import { classesOf } from "./materials.js";
import { numberText, placeText } from "./numbers.js";
import { lettersOf, nearestAxes } from "./sides.js";
import { cropOf } from "./space.js";
import { fragmentCode, mostEnds, vertexCode } from "./space_shader.js";

// Samples that are read without asking, and at most, and along an axis of the texture.
const samplesUnasked = 4e6;
const mostSamples = 160e6;
const longest = 256;

/**
 * A step of half floats below a number from 0 to 1. The texture has half floats, and a sample that is equal to the lower
 * end of a material may have been rounded down.
 */
function beforeHalf(number) {
  return number > 0 ? number - 2 ** (Math.max(Math.floor(Math.log2(number)), -14) - 10) : number;
}

const bone = [0.93, 0.87, 0.78];

/** How much a fog hides in a step, for an opacity from 0 to 1: twice as much for every eighth. */
const densityOf = (opacity) => 0.12 * 2 ** (8 * (opacity - 0.5));

export class SpaceView {
  #section;
  #state;
  #gl;
  #uniforms = {};
  #picture;
  #onChange;
  #map; // the name of the map that the graphics card has
  #mapTexture;
  #isMoving = false;
  #isPlanned = false;
  #drawnSize = [0, 0];
  #reading;
  #isLost = false;
  #level; // that was chosen before the picture was lost

  /** `state` is what the views share; see viewer.js. `onChange()` is called when it is drawn in another way. */
  constructor(section, state, onChange) {
    this.#section = section;
    this.#state = state;
    this.#onChange = onChange;
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "the volume in space");
    section.append(this.canvas);
    section.insertAdjacentHTML(
      "beforeend",
      `
      <div class="middle" hidden><p></p><p><button type="button">Show in 3D</button></p></div>
      <div class="over" hidden>
        <select aria-label="Kind of picture">
          <option value="surface">Surface</option><option value="fog">Volume</option>
          <option value="materials" disabled>Materials</option></select>
        <input type="range" min="0" max="1000" aria-label="Value of the surface, slider">
        <input type="number" step="any" aria-label="Value of the surface">
      </div>
      <svg class="box" viewBox="-1 -1 2 2" preserveAspectRatio="none" aria-hidden="true"><path/></svg>
      <div class="sides" aria-hidden="true">${"<span></span>".repeat(6)}</div>`,
    );
    const find = (selector) => section.querySelector(selector);
    this.elements = {
      middle: find(".middle"),
      text: find(".middle p"),
      button: find("button"),
      over: find(".over"),
      kind: find("select"),
      materials: find("option[value=materials]"),
      slider: find("input[type=range]"),
      number: find("input[type=number]"),
      box: find(".box path"),
      sides: [...section.querySelectorAll(".sides span")],
    };
    const { button, kind, slider, number } = this.elements;
    button.addEventListener("click", () => this.#read());
    kind.addEventListener("change", () => this.#showKind(kind.value));
    slider.addEventListener("input", () => {
      const { low, high } = this.#picture;
      this.isLevelChosen = true;
      this.#setLevel(low + (slider.valueAsNumber / 1000) * (high - low));
    });
    number.addEventListener(
      "input",
      () => {
        if (!Number.isFinite(number.valueAsNumber)) return;
        this.isLevelChosen = true;
        this.#setLevel(number.valueAsNumber);
      },
    );
    this.#handleInput();
    this.#handleLoss();
  }

  #showKind(name) {
    const { kind, slider, number } = this.elements;
    this.#state.space.kind = kind.value = name;
    slider.hidden = number.hidden = name !== "surface";
    this.#onChange();
    this.draw();
  }

  /** True if the user or a link has chosen the value of the surface. */
  isLevelChosen = false;

  /** The value of the surface, if there is one already. */
  get level() {
    return this.#picture?.level ?? this.#level;
  }

  /** Shows what a link says: what `state.space` has now, and the value of the surface. */
  show(level) {
    const { kind } = this.#state.space;
    const { materials } = this.elements;
    if (kind !== "materials" || !materials.disabled) this.#showKind(kind);
    if (level === undefined) return;
    this.isLevelChosen = true;
    this.#level = level;
    if (this.#picture) this.#setLevel(level);
  }

  /** There is another volume. */
  reset() {
    this.#reading?.abort();
    this.#reading = undefined;
    this.#picture = undefined;
    this.#level = undefined;
    this.isLevelChosen = false;
    this.elements.over.hidden = true;
    this.elements.middle.hidden = !this.#isLost;
    for (const side of this.elements.sides) side.hidden = true;
    if (this.#gl) this.#gl.clear(this.#gl.COLOR_BUFFER_BIT);
  }

  /**
   * The graphics card may lose all data: when the machine wakes, because of other pages, or after a crash. The picture
   * is gone until the browser gives the canvas another context; then it is drawn anew.
   */
  #handleLoss() {
    this.canvas.addEventListener("webglcontextlost", (event) => {
      // Otherwise, the browser would not restore the context.
      event.preventDefault();
      this.#isLost = true;
      const { level, isLevelChosen } = this;
      this.reset();
      this.#level = level;
      this.isLevelChosen = isLevelChosen;
      this.#gl = undefined;
      this.texture = undefined;
      const { middle, text, button } = this.elements;
      text.textContent =
        "The 3D picture was lost, because the browser lost the graphics card. It returns when the card is back; " +
        "if it does not, reload the page.";
      button.hidden = true;
      middle.hidden = false;
    });
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.#isLost = false;
      this.elements.middle.hidden = true;
      this.update();
    });
  }

  /** Draws; without a picture, it reads one if it is small, and else offers to. */
  update() {
    if (this.#isLost || !this.#state.volume || this.canvas.clientWidth === 0) return;
    if (this.#picture) {
      const { clientWidth, clientHeight } = this.canvas;
      if (clientWidth !== this.#drawnSize[0] || clientHeight !== this.#drawnSize[1]) this.draw();
      return;
    }
    if (this.#reading) return;
    const { dims, factor } = this.#choice();
    const samples = dims[0] * dims[1] * dims[2];
    if (samples <= samplesUnasked) {
      this.#read();
      return;
    }
    const { middle, text, button } = this.elements;
    const isTooMuch = samples > mostSamples;
    const what = factor > 1 ? `the overview 1:${factor}` : "all samples of the volume";
    text.textContent = isTooMuch
      ? "There is no overview that is small enough for a picture in 3D."
      : `A picture in 3D needs ${what}: ${numberText(samples / 1e6, 2)} million samples.`;
    button.hidden = isTooMuch;
    middle.hidden = false;
  }

  windowChanged() {
    this.draw();
  }

  /** Shows materials as soon as there are some, and a surface when there are none. */
  colorsChanged() {
    const { colors } = this.#state;
    const { materials } = this.elements;
    const wereThere = !materials.disabled;
    const areThere = Boolean(colors?.areOfValues) && classesOf(colors.materials).ends.length <= mostEnds;
    materials.disabled = !areThere;
    if (areThere !== wereThere) {
      const now = this.#state.space.kind;
      this.#showKind(areThere ? "materials" : now === "materials" ? "surface" : now);
    }
    this.draw();
  }

  /** The classes of values as the shader has them, unless materials are not to be shown. */
  #classes() {
    const { colors, showsColors, opacity, space } = this.#state;
    if (space.kind !== "materials" || !showsColors) return { ends: [], tints: [] };
    const { low, high } = this.#picture;
    const { ends, classes } = classesOf(colors.materials);
    // What has no lower limit lies around the others, as air does.
    const isDrawn = (material, i) => i > 0 && material?.isVisible;
    const innermost = classes.findLastIndex(isDrawn);
    const tints = classes.flatMap((material, i) => {
      if (!isDrawn(material, i)) return [0, 0, 0, 0];
      const rgb = [0, 8, 16].map((shift) => ((material.pixel >>> shift) & 255) / 255);
      return [...rgb, i === innermost ? 1 : opacity];
    });
    return { ends: ends.map((end) => beforeHalf((end - low) / (high - low))), tints };
  }

  /** The level that is read: the finest that fits, or the coarsest. */
  #choice() {
    const { levels } = this.#state.volume;
    return levels.find(({ dims }) => Math.max(...dims) <= longest) ?? levels.at(-1);
  }

  async #read() {
    const controller = new AbortController();
    this.#reading = controller;
    const { volume, scale } = this.#state;
    const { level, dims } = this.#choice();
    const { middle, text, button } = this.elements;
    // Every nth sample, where the volume has no overview that fits.
    const every = Math.ceil(Math.max(...dims) / longest);
    const size = dims.map((n) => Math.ceil(n / every));
    middle.hidden = false;
    button.hidden = true;
    try {
      const values = new Float32Array(size[0] * size[1] * size[2]);
      const { brickEdge } = volume;
      for (let z0 = 0; z0 < dims[2]; z0 += brickEdge) {
        text.textContent = `Reading ${Math.round((100 * z0) / dims[2])} %`;
        const z1 = Math.min(z0 + brickEdge, dims[2]);
        const box = { low: [0, 0, z0], high: [dims[0], dims[1], z1] };
        const samples = await volume.read({ level, box, signal: controller.signal });
        for (let z = Math.ceil(z0 / every) * every; z < z1; z += every)
          for (let y = 0; y < dims[1]; y += every) {
            const from = ((z - z0) * dims[1] + y) * dims[0];
            const to = ((z / every) * size[1] + y / every) * size[0];
            for (let x = 0, i = to; x < dims[0]; x += every, ++i)
              values[i] = scale.slope * samples[from + x] + scale.intercept;
          }
      }
      if (controller.signal.aborted) return;
      this.#prepare(values, size);
      middle.hidden = true;
      this.elements.over.hidden = false;
      this.draw();
    } catch (error) {
      if (controller.signal.aborted) return;
      text.textContent = error.message;
    }
  }

  #prepare(values, size) {
    let [low, high] = [Infinity, -Infinity];
    for (const value of values) {
      if (!Number.isFinite(value)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    if (!(low < high)) [low, high] = [Number.isFinite(low) ? low : 0, (Number.isFinite(low) ? low : 0) + 1];
    for (let i = 0; i < values.length; ++i)
      values[i] = values[i] === Infinity ? 1 : Number.isFinite(values[i]) ? (values[i] - low) / (high - low) : 0;
    this.#start();
    const gl = this.#gl;
    if (this.texture) gl.deleteTexture(this.texture);
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_3D, this.texture);
    for (const name of ["S", "T", "R"]) gl.texParameteri(gl.TEXTURE_3D, gl[`TEXTURE_WRAP_${name}`], gl.CLAMP_TO_EDGE);
    for (const name of ["MIN", "MAG"]) gl.texParameteri(gl.TEXTURE_3D, gl[`TEXTURE_${name}_FILTER`], gl.LINEAR);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    // Half floats, which every card interpolates: as fine as 11 bits.
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R16F, ...size, 0, gl.RED, gl.FLOAT, values);
    if (gl.isContextLost()) throw new Error("the graphics card was lost while the picture was made");
    if (gl.getError() !== gl.NO_ERROR) throw new Error("the graphics card has too little memory for a picture in 3D");
    const { volume, steps } = this.#state;
    const lengths = volume.dims.map((n, axis) => n * steps[axis]);
    const most = Math.hypot(...lengths);
    this.#picture = { low, high, size, lengths: lengths.map((l) => l / most), level: 0 };
    const isWithin = this.isLevelChosen || (this.#level >= low && this.#level <= high);
    this.#setLevel(isWithin ? this.#level : this.#likelyLevel(values));
    this.#level = undefined;
  }

  /** The value between the two brightest of three classes: bone, in CT. */
  #likelyLevel(values) {
    const { low, high } = this.#picture;
    const counts = new Uint32Array(1024);
    for (const value of values) ++counts[Math.min(Math.floor(value * 1024), 1023)];
    // Between the two classes that differ most (Otsu's method), of the samples from a number on.
    const split = (from) => {
      let [total, sum] = [0, 0];
      for (let i = from; i < 1024; ++i) [total, sum] = [total + counts[i], sum + i * counts[i]];
      let [below, sumBelow, best, at] = [0, 0, -1, from];
      for (let i = from; i < 1024; ++i) {
        [below, sumBelow] = [below + counts[i], sumBelow + i * counts[i]];
        if (below === 0 || below === total) continue;
        const difference = sumBelow / below - (sum - sumBelow) / (total - below);
        const between = below * (total - below) * difference * difference;
        if (between > best) [best, at] = [between, i + 1];
      }
      return at;
    };
    return low + (split(split(0)) / 1024) * (high - low);
  }

  #setLevel(value) {
    const { low, high } = this.#picture;
    const { slider, number } = this.elements;
    this.#picture.level = value;
    slider.value = (1000 * (value - low)) / (high - low);
    if (document.activeElement !== number) number.value = placeText(value, (high - low) * 1e3);
    this.#onChange();
    this.draw();
  }

  #start() {
    if (this.#gl) return;
    const gl = this.canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL 2, which pictures in 3D need");
    if (gl.isContextLost()) throw new Error("the graphics card was lost; reload the page");
    const program = gl.createProgram();
    for (const [kind, code] of [
      [gl.VERTEX_SHADER, vertexCode],
      [gl.FRAGMENT_SHADER, fragmentCode],
    ]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, code);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS))
      throw new Error(`the graphics card refuses: ${gl.getProgramInfoLog(program)}`);
    gl.useProgram(program);
    const names = "turn size texels span grey level stretch isSurface cropLow cropHigh samples map opacity density tint endCount ends tints";
    for (const name of names.split(" "))
      this.#uniforms[name] = gl.getUniformLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
    const corner = gl.getAttribLocation(program, "corner");
    gl.enableVertexAttribArray(corner);
    gl.vertexAttribPointer(corner, 2, gl.FLOAT, false, 0, 0);
    this.#gl = gl;
    gl.uniform1i(this.#uniforms.samples, 0);
    gl.uniform1i(this.#uniforms.map, 1);
    this.#map = this.#mapTexture = undefined;
  }

  /** Gives the graphics card the map of colors. */
  #useMap(name) {
    if (this.#map === name) return;
    this.#map = name;
    const gl = this.#gl;
    gl.activeTexture(gl.TEXTURE1);
    this.#mapTexture ??= gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.#mapTexture);
    for (const of of ["MIN", "MAG"]) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${of}_FILTER`], gl.LINEAR);
    for (const of of ["S", "T"]) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_WRAP_${of}`], gl.CLAMP_TO_EDGE);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, mapPixels(name, 256));
    gl.activeTexture(gl.TEXTURE0);
  }

  draw() {
    if (this.#isPlanned || !this.#picture || this.canvas.clientWidth === 0) return;
    this.#isPlanned = true;
    requestAnimationFrame(() => {
      this.#isPlanned = false;
      if (this.#picture) this.#drawNow();
    });
  }

  #drawNow() {
    const gl = this.#gl;
    const { low, high, size, lengths, level } = this.#picture;
    const { clientWidth, clientHeight } = this.canvas;
    this.#drawnSize = [clientWidth, clientHeight];
    // Coarser while it moves.
    const ratio = this.#isMoving ? 0.5 : Math.min(devicePixelRatio, 2);
    const [width, height] = [Math.round(clientWidth * ratio), Math.round(clientHeight * ratio)];
    if (this.canvas.width !== width || this.canvas.height !== height)
      [this.canvas.width, this.canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    const { volume, space } = this.#state;
    const { around, up } = space.turn;
    const [ca, sa, cu, su] = [Math.cos(around), Math.sin(around), Math.cos(up), Math.sin(up)];
    // The right, the top and the front of the picture, in left, posterior, head: the head is up, and the patient looks
    // at whoever looks at the picture. Without directions, these are x, y, z.
    const nearest = nearestAxes(this.#state.places.axes);
    const turn = [
      [ca, sa, 0],
      [su * sa * -1, su * ca, cu],
      [cu * sa, -cu * ca, su],
    ].map((vector) => {
      const along = [0, 0, 0];
      for (const [side, { axis, sign }] of nearest.entries()) along[axis] = sign * vector[side];
      return along;
    });
    gl.uniformMatrix3fv(this.#uniforms.turn, false, turn.flat());
    gl.uniform3f(this.#uniforms.size, ...lengths);
    gl.uniform3f(this.#uniforms.texels, ...size);
    const span = 0.5 / space.zoom;
    const shape = width / height;
    const spans = [span * Math.max(shape, 1), span * Math.max(1 / shape, 1)];
    gl.uniform2f(this.#uniforms.span, ...spans);
    this.#placeSides(turn, spans);
    const crop = cropOf(space, volume.dims);
    const shares = [crop.low, crop.high].map((place) => place.map((n, axis) => n / volume.dims[axis]));
    this.#placeBox(turn, spans, shares);
    gl.uniform3f(this.#uniforms.cropLow, ...shares[0]);
    gl.uniform3f(this.#uniforms.cropHigh, ...shares[1]);
    this.#useMap(space.map);
    gl.uniform1f(this.#uniforms.opacity, space.opacity.surface);
    gl.uniform1f(this.#uniforms.density, densityOf(space.opacity.fog));
    const { shades } = this.#state;
    gl.uniform2f(this.#uniforms.grey, (shades.low - low) / (high - low), (shades.high - low) / (high - low));
    gl.uniform1f(this.#uniforms.level, (level - low) / (high - low));
    gl.uniform1f(this.#uniforms.stretch, this.#isMoving ? 1 : 0.5);
    gl.uniform1i(this.#uniforms.isSurface, space.kind === "fog" ? 0 : 1);
    // The color of its value, but never black: then its shape could not be seen.
    const share = Math.max((level - shades.low) / (shades.high - shades.low), 0.25);
    const tint = space.map === "grey" ? bone : colorIn(space.map, share).map((n) => n / 255);
    gl.uniform3f(this.#uniforms.tint, ...tint);
    const { ends, tints } = this.#classes();
    gl.uniform1i(this.#uniforms.endCount, ends.length);
    if (ends.length > 0) {
      gl.uniform1fv(this.#uniforms.ends, ends);
      gl.uniform4fv(this.#uniforms.tints, tints);
    }
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Letters at the middles of the faces of the box that look at the viewer. */
  #placeSides([right, top, front], spans) {
    const { axes } = this.#state.places;
    const { lengths } = this.#picture;
    for (const [i, side] of this.elements.sides.entries()) {
      const axis = i >> 1;
      const sign = i % 2 === 0 ? 1 : -1;
      side.hidden = sign * front[axis] < 0.15 || (!axes && sign < 0);
      side.textContent = axes ? lettersOf(axes[axis].map((n) => sign * n)) : "xyz"[axis];
      const at = (sign * lengths[axis]) / 2;
      side.style.left = `${50 + (50 * at * right[axis]) / spans[0]}%`;
      side.style.top = `${50 - (50 * at * top[axis]) / spans[1]}%`;
    }
  }

  /** The edges of the box that is left, if it is not the whole one. */
  #placeBox([right, top], spans, [low, high]) {
    const { lengths } = this.#picture;
    const isWhole = low.every((n) => n === 0) && high.every((n) => n === 1);
    const corner = (bits) => [0, 1, 2].map((axis) => ((bits & (1 << axis) ? high : low)[axis] - 0.5) * lengths[axis]);
    const pointOf = (p) => [right, top].map((v, i) => ((i === 0 ? 1 : -1) * p.reduce((sum, n, axis) => sum + n * v[axis], 0)) / spans[i]);
    const edges = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((bits) =>
      [1, 2, 4].filter((bit) => !(bits & bit)).map((bit) => `M${pointOf(corner(bits))}L${pointOf(corner(bits | bit))}`),
    );
    this.elements.box.setAttribute("d", isWhole ? "" : edges.join(""));
  }

  #handleInput() {
    const { canvas } = this;
    const turnBy = (dx, dy) => {
      const { space } = this.#state;
      const { around, up } = space.turn;
      space.turn = { around: around - dx, up: Math.min(Math.max(up + dy, -1.55), 1.55) };
      this.#onChange();
      this.draw();
    };
    const zoomBy = (factor) => {
      const { space } = this.#state;
      space.zoom = Math.min(Math.max(space.zoom * factor, 0.3), 20);
      this.#onChange();
      this.draw();
    };
    followPointers(canvas, {
      start: () => (this.#isMoving = true),
      drag: (dx, dy) => turnBy(dx / 150, dy / 150),
      pinch: (factor) => {
        this.#isMoving = true;
        zoomBy(factor);
      },
      end: () => {
        this.#isMoving = false;
        this.draw();
      },
    });
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        zoomBy(Math.sqrt(wheelZoom(event)));
      },
      { passive: false },
    );
    canvas.addEventListener("keydown", (event) => {
      const work = {
        ArrowLeft: () => turnBy(-0.1, 0),
        ArrowRight: () => turnBy(0.1, 0),
        ArrowUp: () => turnBy(0, -0.1),
        ArrowDown: () => turnBy(0, 0.1),
        "+": () => zoomBy(1.2),
        "=": () => zoomBy(1.2),
        "-": () => zoomBy(1 / 1.2),
      }[event.key];
      if (!work) return;
      event.preventDefault();
      event.stopPropagation();
      work();
    });
  }
}
