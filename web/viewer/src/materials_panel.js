// The panel of materials and labels: what samples are colored by, how, and a legend.
import { addressOf, nameOf } from "./addresses.js";
import { LabelColors, ValueColors } from "./colors.js";
import {
  lieElsewhere, materialsOf, namesInFile, namesOf, nameWithout, requireLabels, requireSameSize,
} from "./materials.js";
import { numberText } from "./numbers.js";

const element = (id) => document.getElementById(id);
// Labels whose names the legend has at most.
const mostRows = 300;

export class MaterialsPanel {
  #state;
  #open;
  #tilesOf;
  #onChange;
  #text = "";
  #names = new Map();
  // Of another file: { name, volume, tiles }; without a volume while it is opened, or with an `error`.
  #labels;
  #mistake = ""; // of the user, in words
  // What was hidden stays hidden when limits change, or another volume is shown.
  #hidden = new Set();
  #isListed = false;
  #materials = new WeakMap(); // of rows of the legend

  /**
   * `state` is what the views share; see viewer.js. `open(source)` opens a file, `tilesOf(volume)` makes its tiles, and
   * `onChange()` is called when other colors are to be drawn.
   */
  constructor(state, open, tilesOf, onChange) {
    this.#state = state;
    this.#open = open;
    this.#tilesOf = tilesOf;
    this.#onChange = onChange;
    element("color-by").addEventListener("change", ({ target }) => {
      this.#mistake = "";
      this.apply();
      if (target.value === "values") element("materials").focus();
    });
    element("materials").addEventListener("change", ({ target }) => this.setMaterials(target.value));
    const onFile = (id, work) =>
      element(id).addEventListener("change", ({ target }) => {
        const [file] = target.files;
        // The same file may be chosen again when it has changed.
        target.value = "";
        if (file) work(file);
      });
    onFile("label-file", (file) => this.openLabels(() => file, file.name));
    onFile("names-file", (file) => this.setNames(async () => namesInFile(await file.text(), file.name)));
    element("opacity").addEventListener("input", ({ target }) => {
      state.opacity = target.valueAsNumber / 100;
      onChange();
    });
    element("show-colors").addEventListener("click", () => this.toggle());
  }

  /** Shows the colors, or hides them. */
  toggle() {
    if (!this.#state.colors) return;
    this.#state.showsColors = !this.#state.showsColors;
    element("show-colors").setAttribute("aria-pressed", String(this.#state.showsColors));
    this.#onChange();
  }

  /** What an address says: `materials` and `labels` as the options of these names, and where `labelVolume` is. */
  start({ materials, labels, labelVolume }) {
    if (materials !== null && (labels !== null || labelVolume !== null)) {
      this.#mistake = "materials: cannot be combined with labels; samples are values or labels";
      this.apply();
    } else if (materials !== null) {
      element("materials").value = materials;
      this.setMaterials(materials);
    } else if (labels !== null || labelVolume !== null) {
      element("color-by").value = labelVolume === null ? "labels" : "file";
      if (labelVolume !== null) this.openLabels(() => addressOf(labelVolume), nameOf(labelVolume));
      if (labels !== null)
        this.setNames(async () => namesOf(labels) ?? namesInFile(await textAt(addressOf(labels)), nameOf(labels)));
    }
  }

  /** What an address has of values; and whether it may have labels. */
  get link() {
    const kind = element("color-by").value;
    const hasValues = kind === "values" && this.#text !== "";
    return { materials: hasValues ? this.#text : undefined, hasLabels: kind === "labels" || kind === "file" };
  }

  setMaterials(text) {
    this.#text = text.trim();
    element("color-by").value = "values";
    this.#mistake = "";
    this.apply();
  }

  /** The names of labels, which `read()` finds. */
  async setNames(read) {
    try {
      this.#names = await read();
      this.#mistake = "";
    } catch (error) {
      this.#mistake = `names of labels: ${error.message}`;
    }
    this.apply();
  }

  /** Opens a file of labels, at what `source()` returns; of several, the one that was chosen last is shown. */
  async openLabels(source, name) {
    const before = this.#labels;
    const labels = { name };
    this.#labels = labels;
    element("color-by").value = "file";
    this.#mistake = "";
    this.apply();
    before?.tiles?.close();
    before?.volume?.close();
    try {
      const volume = await this.#open(source());
      if (this.#labels !== labels) return volume.close();
      Object.assign(labels, { volume, tiles: this.#tilesOf(volume) });
    } catch (error) {
      labels.error = new Error(`${name}: ${error.message}`);
    }
    if (this.#labels === labels) this.apply();
  }

  /** Makes the colors for the volume that is shown now. */
  apply() {
    const state = this.#state;
    const kind = element("color-by").value;
    element("materials").hidden = kind !== "values";
    element("label-file-choice").hidden = kind !== "file";
    element("names-choice").hidden = kind !== "file" && kind !== "labels";
    state.colors = state.labels = undefined;
    this.#say(this.#mistake);
    try {
      if (state.volume && this.#mistake === "") this.#make(kind);
    } catch (error) {
      this.#say(error.message);
    }
    for (const material of state.colors?.materials ?? []) this.#hide(material);
    element("colors-use").hidden = !state.colors;
    element("legend").replaceChildren();
    this.#list();
    this.#onChange();
  }

  #make(kind) {
    const state = this.#state;
    const { volume, scale, tiles, name } = state;
    if (kind === "values" && this.#text !== "") {
      const ranges = materialsOf(this.#text);
      if (scale.note) throw new Error("each slice has its own slope, so values cannot be colored");
      state.colors = new ValueColors(ranges, scale, volume.type);
    }
    const labels = { labels: { volume, tiles, name }, file: this.#labels }[kind];
    if (!labels) return;
    if (labels.error) throw labels.error;
    if (!labels.volume) return this.#say(`Opening ${labels.name} …`, false);
    requireSameSize(labels.volume, labels.name, volume, name);
    requireLabels(labels.volume, labels.name);
    state.labels = labels;
    state.colors = new LabelColors(this.#names);
    state.colors.onNew = (material) => {
      this.#hide(material);
      this.#isListed = false;
    };
    if (labels.volume !== volume && lieElsewhere(labels.volume, volume))
      this.#say(`the labels in ${labels.name} lie elsewhere than the samples of ${name}`);
  }

  #hide(material) {
    if (this.#hidden.has(keyOf(material))) this.#state.colors.setVisible(material, false);
  }

  #say(text, isError = true) {
    element("colors-note").textContent = text;
    element("colors-note").classList.toggle("error", isError);
  }

  // ---- The legend --------------------------------------------------------------------------------------------------

  /** Lists labels that were seen since. */
  update() {
    if (!this.#isListed) this.#list();
  }

  #list() {
    this.#isListed = true;
    const legend = element("legend");
    const materials = this.#state.colors?.materials ?? [];
    // Rows that are there stay: one of them may have the focus.
    for (const [i, material] of materials.slice(0, mostRows).entries())
      if (this.#materials.get(legend.children[i]) !== material)
        legend.insertBefore(this.#row(material), legend.children[i] ?? null);
    while (legend.childElementCount > mostRows) legend.lastElementChild.remove();
    const more = materials.length - mostRows;
    element("legend-more").textContent = more > 0 ? `and ${more} more` : "";
  }

  #row(material) {
    const row = document.createElement("li");
    const label = row.appendChild(document.createElement("label"));
    const box = label.appendChild(document.createElement("input"));
    Object.assign(box, { type: "checkbox", checked: material.isVisible });
    const swatch = label.appendChild(document.createElement("span"));
    swatch.className = "swatch";
    swatch.style.background = material.color;
    label.append(material.name);
    row.appendChild(document.createElement("span")).textContent = meaningOf(material);
    box.addEventListener("change", () => {
      if (box.checked) this.#hidden.delete(keyOf(material));
      else this.#hidden.add(keyOf(material));
      this.#state.colors.setVisible(material, box.checked);
      this.#onChange();
    });
    this.#materials.set(row, material);
    return row;
  }
}

/** What a material is when limits change, or another volume is shown. */
const keyOf = ({ label, name }) => label ?? name;

/** The label of a material, or its values: from the lower end up to, but not including, the higher one. */
function meaningOf({ name, label, low, high }) {
  if (label !== undefined) return name === nameWithout(label) ? "" : `label ${label}`;
  if (low === -Infinity) return `below ${numberText(high)}`;
  return high === Infinity ? `from ${numberText(low)}` : `${numberText(low)} to ${numberText(high)}`;
}

async function textAt(url) {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url.pathname}: the server answers with ${answer.status}`);
  return answer.text();
}
