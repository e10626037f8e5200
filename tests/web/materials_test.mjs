// Texts of materials and labels, and what samples they color, without a browser.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";
import { folder, tagrid } from "./files.mjs";
import { LabelColors, ValueColors } from "../../web/viewer/src/colors.js";
import {
  classesOf,
  materialsOf,
  namesInFile,
  namesOf,
  palette,
  requireLabels,
  requireSameSize,
} from "../../web/viewer/src/materials.js";

const path = join(folder, "labels.tag");
before(() => {
  // Values from 0 to 9, which are also labels.
  const head = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 12 12 12\nencoding: raw\nspacings: 1 1 1\n\n";
  const samples = Uint8Array.from({ length: 12 ** 3 }, (_, i) => Math.floor(i / 173));
  writeFileSync(join(folder, "labels.nrrd"), Buffer.concat([Buffer.from(head), samples]));
  tagrid("encode", join(folder, "labels.nrrd"), "-q", "-o", path);
});

/** What the program says of options of a mesh; "" if it takes them, even for a mesh of nothing. */
function errorOfProgram(...options) {
  try {
    tagrid("mesh", path, ...options, "-q", "-f", "-o", join(folder, "mesh.vtu"));
    return "";
  } catch ({ stderr }) {
    return /mesh would be empty|no tetrahedron is of a label/.test(stderr) ? "" : String(stderr);
  }
}

function errorOf(work) {
  try {
    work();
    return "";
  } catch ({ message }) {
    return message;
  }
}

/** Both take a text, or refuse it in the same words. */
function assertSame(text, found, expected) {
  assert.equal(found === "", expected === "", `${text}\nviewer: ${found}\nprogram: ${expected}`);
  assert.ok(expected.includes(found), `${text}\nviewer: ${found}\nprogram: ${expected}`);
}

test("materials: the viewer takes the texts that tagrid mesh takes, and refuses others in its words", () => {
  const texts = [
    "low=:3,middle=3:6,high=6:",
    "high=6:,low=:3,middle=3:6",
    "a=1:2",
    "a=1:2,b=4:5",
    "a_1=.5:2.,B2=2:1e1",
    "a=+1:+2,b=2:2.5E0",
    "a=-3:1",
    "a=-0:1",
    `${"n".repeat(38)}=1:`,
    `${"n".repeat(39)}=1:`,
    "a",
    "a=",
    "a=1",
    "=1:2",
    ":1=2",
    "a:b=1:2",
    "a=1:2:3",
    "a=1:2,",
    ",a=1:2",
    "a=1:2, b=2:3",
    "a b=1:2",
    "1a=1:2",
    "é=1:2",
    "_a=1:2",
    "_=1:2",
    "soft tissue=1:2",
    "a__b=1:2,a-b=2:3",
    "1a=1:2,m_1a=2:3",
    "a=x:2",
    "a=1:0x2",
    "a=1:inf",
    "a=nan:2",
    "a=1:+-2",
    "a= 1:2",
    "a=1:1e999",
    "a=2:2",
    "a=3:2",
    "a=:",
    "a=1:3,b=2:4",
    "a=:3,b=:2",
    "a=1:,b=2:",
    "a=1:2,a=2:3",
    "a=1:2,A=2:3",
    "a=1:2,b=2.000000001:3",
  ];
  const refused = texts.filter((text) => {
    const found = errorOf(() => materialsOf(text));
    assertSame(text, found, errorOfProgram("--materials", text));
    return found !== "";
  });
  assert.ok(refused.length > 20 && texts.length - refused.length > 7, `${refused.length} of ${texts.length}`);
});

test("names of labels: the viewer takes the texts and files that tagrid mesh takes, and refuses others in its words", () => {
  for (const text of ["all", "1=a", "1=a,2=b", "+3=c", "03=c", "0=a", "1=a,1=b", "1=a,2", "x=a", "1.5=a", "-1=a", "65536=a"])
    assertSame(text, errorOf(() => namesOf(text)), errorOfProgram("--labels", text));
  const files = [
    ["1,bone\n2,soft tissue\n"],
    ["label,name\n1,bone\r\n2,soft\r\n"],
    ["# ITK-SnAP\n    0     0    0    0        0  0  0    \"Clear Label\"\n    1   255    0    0        1  1  1    \"Left knee\"\n"],
    ["# 3D Slicer\n0 Background 0 0 0 0\n1 bone 216 101 79 255\n"],
    ["1;bone\n\n2;soft"],
    ["1\tbone marrow\t3"],
    ["\ufeff1,bone"],
    [""],
    ["label,name\n"],
    ["1,bone\n1,soft"],
    ["1,bone\nname,2"],
    ["1,2,3"],
    ["x1,bone"],
    ["1 Lobe 2 left 216 101 79 255"],
    ["1 left knee 3 4"],
  ];
  const file = join(folder, "names.csv");
  let refused = 0;
  for (const [content] of files) {
    writeFileSync(file, content);
    const found = errorOf(() => namesInFile(content, file));
    assertSame(content, found, errorOfProgram("--labels", file));
    refused += found !== "";
  }
  assert.equal(refused, 6);
  assert.deepEqual([...namesInFile(files[2][0], file)], [[1, "Left knee"]]);
  assert.deepEqual([...namesInFile(files[3][0], file)], [[1, "bone"]]);
  assert.deepEqual([...namesInFile(files[13][0], file)], [[1, "Lobe 2 left"]]);
  assert.deepEqual([...namesInFile(files[14][0], file)], [[1, "left knee"]]);
  assert.deepEqual([...namesInFile(files[0][0], file)], [[1, "bone"], [2, "soft tissue"]]);
  assert.deepEqual([...namesInFile(files[5][0], file)], [[1, "bone marrow"]]);
  assert.deepEqual([...namesOf("all")], []);
  assert.equal(namesOf("https://example.org/names.csv"), undefined);
});

const identity = { slope: 1, intercept: 0 };
const nameAt = (colors, sample) => colors.materialOf(sample)?.name;

test("a material has the values from its lower end up to, but not including, the higher one", () => {
  const ranges = materialsOf("air=:-200,soft=-200:300,metal=2000:");
  for (const [sample, name] of [
    [-1024, "air"],
    [-201, "air"],
    [-200, "soft"],
    [299, "soft"],
    [300, undefined],
    [1999, undefined],
    [2000, "metal"],
    [32767, "metal"],
  ])
    assert.equal(nameAt(new ValueColors(ranges, identity, "int16"), sample), name, `${sample}`);
  const floats = new ValueColors(ranges, identity, "float32");
  assert.equal(nameAt(floats, -Infinity), "air");
  assert.equal(nameAt(floats, Infinity), "metal");
  assert.equal(nameAt(floats, NaN), undefined);
  // After slope and intercept, in float32, as the program decodes values: 0.29 * 100 is less than 29 in double precision.
  const scaled = new ValueColors(materialsOf("low=:29,high=29:"), { slope: 0.29, intercept: 0 }, "int16");
  assert.equal(nameAt(scaled, 99), "low");
  assert.equal(nameAt(scaled, 100), "high");
  const falling = new ValueColors(materialsOf("low=:0,high=0:"), { slope: -1, intercept: 10 }, "uint8");
  assert.deepEqual([10, 11].map((sample) => nameAt(falling, sample)), ["high", "low"]);
});

/** The color of a pixel, as CSS writes it; "" if it is transparent. */
const cssOf = (pixel) =>
  pixel === 0 ? "" : `#${[0, 8, 16].map((shift) => ((pixel >>> shift) & 255).toString(16).padStart(2, "0")).join("")}`;

test("each sample of every type is painted in the color of its material, and what is hidden is not", () => {
  const ranges = materialsOf("a=:-5,b=7:20,c=20:");
  for (const Samples of [Uint8Array, Int8Array, Uint16Array, Int16Array, Uint32Array, Int32Array, Float32Array, Float64Array]) {
    const samples = Samples.from({ length: 100 }, (_, i) => i - 50);
    const colors = new ValueColors(ranges, { slope: 2, intercept: 1 }, Samples.name.slice(0, -5).toLowerCase());
    const pixels = new Uint32Array(samples.length);
    for (const hidden of [undefined, colors.materials[1]]) {
      const version = colors.version;
      if (hidden) colors.setVisible(hidden, false);
      assert.equal(colors.version !== version, hidden !== undefined);
      colors.paint(samples, pixels);
      for (const [i, sample] of samples.entries()) {
        const value = 2 * sample + 1;
        const number = value < -5 ? 0 : value >= 20 ? 2 : value >= 7 && !hidden ? 1 : undefined;
        assert.equal(cssOf(pixels[i]), number === undefined ? "" : palette[number], `${Samples.name} ${sample}`);
      }
    }
  }
});

test("labels have the same color whatever is seen first, and those without a name have none if others do", () => {
  const paint = (colors, ...labels) => {
    const pixels = new Uint32Array(labels.length);
    colors.paint(Uint16Array.from(labels), pixels);
    return [...pixels].map(cssOf);
  };
  const [one, other] = [new LabelColors(new Map()), new LabelColors(new Map())];
  let count = 0;
  one.onNew = () => ++count;
  paint(other, 9, 65535, 2);
  assert.deepEqual(paint(one, 0, 1, 2, 9, 65535), ["", palette[0], palette[1], palette[1], palette[65534 % 7]]);
  assert.deepEqual(paint(other, 0, 1, 2, 9, 65535), paint(one, 0, 1, 2, 9, 65535));
  assert.equal(count, 4);
  assert.deepEqual(other.materials.map(({ label, name }) => `${label} ${name}`), ["1 label_1", "2 label_2", "9 label_9", "65535 label_65535"]);
  one.setVisible(one.materials[1], false);
  assert.deepEqual(paint(one, 1, 2, 9), [palette[0], "", palette[1]]);
  const named = new LabelColors(namesOf("2=bone,0=air"));
  assert.deepEqual(paint(named, 0, 1, 2), [palette[6], "", palette[1]]);
  assert.deepEqual(named.materials.map(({ name }) => name), ["air", "bone"]);
  assert.deepEqual([0, 1, 2].map((label) => nameAt(named, label)), ["air", undefined, "bone"]);
});

test("classes of values are the materials and what lies between them", () => {
  const { ends, classes } = classesOf(materialsOf("bone=300:,soft=-200:100,air=:-200"));
  assert.deepEqual(ends, [-200, 100, 300]);
  assert.deepEqual(classes.map((material) => material?.name), ["air", "soft", undefined, "bone"]);
  assert.deepEqual(classesOf(materialsOf("a=1:2")), { ends: [1, 2], classes: [undefined, { name: "a", low: 1, high: 2 }, undefined] });
});

test("samples that cannot be labels of a volume are refused, with what they are", () => {
  const labels = { dims: [4, 5, 6], type: "uint8", range: { low: 0, high: 3 }, bounds: { maxError: 0 } };
  const errorWith = (changed) => errorOf(() => requireLabels({ ...labels, ...changed }, "a.tag"));
  assert.equal(errorWith({}), "");
  assert.equal(errorWith({ type: "float32" }), "a.tag: labels must be integers, but its samples are float32");
  assert.match(errorWith({ range: { low: -1, high: 3 } }), /from 0 to 65535, but its samples are from -1 to 3/);
  assert.match(errorWith({ range: { low: 0, high: 65536 } }), /from 0 to 65535, but its samples are from 0 to 65536/);
  assert.match(errorWith({ bounds: { maxError: 2 } }), /may be wrong by 2, so they cannot be labels/);
  assert.match(errorWith({ bounds: { maxError: null } }), /may be wrong, so they cannot be labels/);
  const size = errorOf(() => requireSameSize(labels, "a.tag", { dims: [4, 5, 7] }, "b.tag"));
  assert.equal(size, "a.tag: has 4 x 5 x 6 labels, but b.tag has 4 x 5 x 7 samples");
});
