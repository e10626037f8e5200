// What the viewer says of sides and numbers, and what it takes a wheel for, without a browser.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";
import { folder, tagrid } from "./files.mjs";
import { boundRows, factRows, lossText, scaleOf } from "../../web/viewer/src/describe.js";
import { numberText, placeText, sampleText, valueText } from "../../web/viewer/src/numbers.js";
import { placesOf, positionTexts } from "../../web/viewer/src/places.js";
import { axesOf, layoutsOf, lettersOf, nearestAxes } from "../../web/viewer/src/sides.js";
import { wheelSlices } from "../../web/viewer/src/gestures.js";

/** What the decoder gives for a header with these fields. */
function volumeOf({
  space,
  directions = null,
  spacing = directions?.map((d) => Math.hypot(...d)) ?? null,
  origin = null,
  dims = [30, 30, 30],
  fields = {},
  pairs = {},
}) {
  return {
    dims,
    geometry: { spacing, origin, directions },
    field: (name) => ({ space, ...fields })[name],
    pair: (key) => pairs[key],
  };
}

const permutations = [
  [0, 1, 2],
  [0, 2, 1],
  [1, 0, 2],
  [1, 2, 0],
  [2, 0, 1],
  [2, 1, 0],
];
const signs = [1, -1];
/** All matrices that turn axes into axes: 48, half of which mirror. */
const matrices = permutations.flatMap((order) =>
  signs.flatMap((a) =>
    signs.flatMap((b) =>
      signs.map((c) =>
        order.map((row, axis) => [0, 1, 2].map((i) => (i === row ? [a, b, c][axis] * [0.5, 0.7, 3][axis] : 0))),
      ),
    ),
  ),
);
/** What each coordinate of a space counts: the side to which it grows, and the other one. */
const spaces = {
  "left-posterior-superior": ["LR", "PA", "HF"],
  LPS: ["LR", "PA", "HF"],
  "right-anterior-superior": ["RL", "AP", "HF"],
  ras: ["RL", "AP", "HF"],
  "Left-Anterior-Superior": ["LR", "AP", "HF"],
};

test("all 48 axis-aligned orientations: the letter at an edge is that of the position there", () => {
  assert.equal(new Set(matrices.map(String)).size, 48);
  for (const [space, names] of Object.entries(spaces))
    for (const directions of matrices) {
      const volume = volumeOf({ space, directions, origin: [7, -9, 100] });
      const positionOf = (sample) =>
        [0, 1, 2].map(
          (i) => volume.geometry.origin[i] + sample.reduce((sum, n, axis) => sum + n * directions[axis][i], 0),
        );
      for (const layout of layoutsOf(axesOf(volume))) {
        const { normal, across, down, sides, title } = layout;
        assert.deepEqual([normal, across, down].sort(), [0, 1, 2]);
        // The samples in the middle of the picture, and at each of its edges.
        const middle = [15, 15, 15];
        for (const [edge, axis, way] of [
          ["left", across, -layout.signs[0]],
          ["right", across, layout.signs[0]],
          ["top", down, -layout.signs[1]],
          ["bottom", down, layout.signs[1]],
        ]) {
          const there = [...middle];
          there[axis] += 15 * way;
          const moved = positionOf(there).map((n, i) => n - positionOf(middle)[i]);
          const row = moved.findIndex((n) => Math.abs(n) > 1);
          assert.equal(sides[edge], names[row][moved[row] > 0 ? 0 : 1], `${space} ${directions} ${title} ${edge}`);
        }
        // As radiologists hang pictures.
        assert.deepEqual(
          [sides.left, sides.top],
          { axial: ["R", "A"], coronal: ["R", "H"], sagittal: ["A", "H"] }[title],
        );
        // Slices of a plane lie along the coordinate that the plane does not have.
        const step = directions[normal].findIndex((n) => n !== 0);
        assert.equal(step, { axial: 2, coronal: 1, sagittal: 0 }[title]);
      }
    }
});

test("oblique directions have the letters of all their sides, the nearest first", () => {
  const [c, s] = [Math.cos(Math.PI / 6), Math.sin(Math.PI / 6)];
  // Turned by 30 degrees: columns run to the left and the back.
  const turned = volumeOf({
    space: "LPS",
    directions: [
      [c, s, 0],
      [-s, c, 0],
      [0, 0, 2],
    ],
  });
  const [axial, coronal] = layoutsOf(axesOf(turned));
  assert.equal(axial.title, "axial (oblique)");
  assert.deepEqual(axial.sides, { left: "RA", right: "LP", top: "AL", bottom: "PR" });
  assert.deepEqual(coronal.sides, { left: "RA", right: "LP", top: "H", bottom: "F" });
  assert.equal(lettersOf([0.1, -0.6, -0.7]), "FAL");
  assert.equal(lettersOf([0.01, 0, 1]), "H");
  // A tilted gantry: angles are not true.
  const tilted = volumeOf({
    space: "LPS",
    directions: [
      [1, 0, 0],
      [0, 1, 0],
      [0, -0.5, 2],
    ],
  });
  assert.match(placesOf(tilted).notes.join(), /not perpendicular/);
  assert.deepEqual(
    layoutsOf(axesOf(tilted)).map(({ title }) => title),
    ["axial", "coronal (oblique)", "sagittal (oblique)"],
  );
  // Halfway between two planes, each plane is still named once.
  const h = Math.SQRT1_2;
  const halfway = axesOf(
    volumeOf({
      space: "RAS",
      directions: [
        [h, h, 0],
        [-h, h, 0],
        [0, 0, 1],
      ],
    }),
  );
  assert.deepEqual(
    layoutsOf(halfway)
      .map(({ normal }) => normal)
      .sort(),
    [0, 1, 2],
  );
});

test("without directions of a patient, nothing is said of sides", () => {
  const directions = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  for (const volume of [
    volumeOf({}),
    volumeOf({ spacing: [1, 1, 1] }),
    volumeOf({ directions }),
    volumeOf({ space: "scanner-xyz", directions }),
    volumeOf({ space: "3D-left-handed", directions }),
    volumeOf({ space: "left-posterior", directions }),
    volumeOf({ space: "LPS" }),
    volumeOf({ space: "posterior-left-superior", directions }),
    volumeOf({
      space: "LPS",
      directions: [
        [1, 0, 0],
        [1, 0, 0],
        [0, 0, 1],
      ],
    }),
    volumeOf({
      space: "LPS",
      directions: [
        [1, 0, 0],
        [0, NaN, 0],
        [0, 0, 1],
      ],
    }),
  ]) {
    assert.equal(axesOf(volume), undefined);
    assert.match(placesOf(volume).notes.join(), /directions unknown/);
    const layouts = layoutsOf(axesOf(volume));
    assert.deepEqual(
      layouts.map(({ title }) => title),
      ["x–y", "x–z", "y–z"],
    );
    assert.ok(layouts.every(({ sides }) => sides === undefined));
    assert.deepEqual(
      layouts.map(({ normal }) => normal),
      [2, 1, 0],
    );
  }
});

test("units and distances", () => {
  const unitOf = (given) => placesOf(volumeOf(given)).unit;
  const spacing = [1, 2, 3];
  assert.equal(unitOf({}), "samples");
  assert.equal(unitOf({ spacing }), "units");
  assert.equal(unitOf({ spacing, fields: { units: '"cm" "cm" "cm"' } }), "cm");
  assert.equal(unitOf({ spacing, fields: { units: '"um" "µm" "micron"' } }), "µm");
  assert.equal(unitOf({ spacing, fields: { units: '"parsec" "parsec" "parsec"' } }), "parsec");
  // Only the file says it: in a space of patients, too, lengths may be in meters.
  for (const space of ["LPS", "scanner-xyz"])
    assert.equal(unitOf({ space, directions: matrices[0] }), "units");
  assert.equal(unitOf({ space: "LPS", directions: matrices[0], fields: { "space units": '"mm" "mm" "mm"' } }), "mm");
  const mixed = placesOf(volumeOf({ spacing, fields: { units: '"mm" "cm" "um"' } }));
  assert.deepEqual([mixed.unit, mixed.steps.map((n) => numberText(n))], ["mm", ["1", "20", "0.003"]]);
  const some = placesOf(volumeOf({ spacing: [0.5, NaN, 0.5], fields: { units: '"mm" "mm" "mm"' } }));
  assert.match(some.notes.join(), /distance along y unknown: drawn as 1 mm$/);
  const noUnit = placesOf(volumeOf({ spacing: [0.5, NaN, 0.5] }));
  assert.match(noUnit.notes.join(), /distance along y unknown: drawn as 1 unit$/);
});

const factsOf = (given) => {
  const volume = { type: "int16", levels: [], range: { low: 2, high: 640, mean: 77 }, fileBytes: 5, brickEdge: 32, volumes: 1 };
  const whole = { ...volumeOf(given), ...volume };
  return factRows(whole, scaleOf(whole), placesOf(whole));
};

test("a spacing without a unit is said to have none, as in a preview", () => {
  const spacingOf = (given) => Object.fromEntries(factsOf(given)).spacing;
  assert.equal(spacingOf({ spacing: [1, 2, 3] }), "1 × 2 × 3 (no unit given)");
  assert.equal(spacingOf({ spacing: [1, 2, 3], fields: { units: '"cm" "cm" "cm"' } }), "1 × 2 × 3 cm");
  assert.equal(spacingOf({}), undefined);
});

test("errors are in values, or say that they are in stored samples, with the largest one in values", () => {
  const bounds = { maxError: 10, surfaceError: 4, meshError: null, achievedMaxError: 9, achievedRmse: 1.23456, achievedPsnr: 50 };
  const textsOf = (pairs, dims = [30, 30, 3]) => {
    const volume = { ...volumeOf({ pairs, dims }), bounds };
    return { ...Object.fromEntries(boundRows(volume, scaleOf(volume))), loss: lossText(volume, scaleOf(volume)) };
  };
  const plain = textsOf({ rescale_slope: "-0.5", rescale_units: "HU" });
  assert.equal(plain["largest error allowed"], "5 HU");
  assert.equal(plain.loss, "lossy: errors up to 5 HU");
  // A PET series: the factor grows from slice to slice.
  const slices = textsOf({ slice_slopes: "1 4.857 2", slice_intercepts: "0 0 0" });
  assert.deepEqual(slices, {
    "largest error allowed": "10 in stored samples (at most 48.57 in values)",
    "… of the grid's points": "4 in stored samples (at most 19.428 in values)",
    "largest error found": "9 in stored samples (at most 43.713 in values)",
    "root mean square error": "1.235 in stored samples (at most 5.99626 in values)",
    PSNR: "50 dB",
    loss: "lossy: errors up to 10 in stored samples (at most 48.57 in values)",
  });
  // Slopes that cannot be read give no values.
  assert.equal(textsOf({ slice_slopes: "1 x 2" }).loss, "lossy: errors up to 10 in stored samples");
});

test("no two facts of a volume have the same name", () => {
  for (const pairs of [{}, { slice_slopes: "1 2 3" }, { rescale_slope: "2" }]) {
    const names = factsOf({ spacing: [1, 2, 3], dims: [30, 30, 3], pairs }).map(([name]) => name);
    assert.deepEqual(names, [...new Set(names)]);
  }
  const facts = Object.fromEntries(factsOf({ dims: [30, 30, 3], pairs: { slice_slopes: "1 2 3" } }));
  assert.equal(facts["stored samples"].trim(), "2 to 640");
});

test("no number is rounded to another one that is stored", () => {
  const same = { slope: 1, intercept: 0 };
  for (const n of [0, -1, 1234567, 2 ** 31 - 1, -(2 ** 31), 2 ** 32 - 1])
    assert.equal(valueText(n, "int32", same), String(n));
  assert.equal(valueText(1234567, "int32", { slope: 0.1, intercept: -1024 }), "122432.7");
  assert.equal(valueText(2 ** 32 - 1, "uint32", { slope: 0.25, intercept: 0 }), "1073741823.75");
  assert.equal(valueText(3, "uint8", { slope: 0.1, intercept: 0 }), "0.3");
  const floats = new Float32Array([
    0.1,
    1 / 3,
    16777217,
    1.17549435e-38,
    1e-45,
    3.4028235e38,
    -123456.789,
    NaN,
    Infinity,
    -Infinity,
    -0,
  ]);
  for (const f of floats) {
    const text = sampleText(f, "float32");
    assert.ok(Object.is(Math.fround(Number(text)), f), `${f}: ${text}`);
    assert.ok(text.length <= 15, text);
  }
  assert.equal(sampleText(floats[0], "float32"), "0.1");
  for (const d of [0.1, 1 / 3, 5e-324, 1.7976931348623157e308, 9007199254740993])
    assert.equal(Number(sampleText(d, "float64")), d);
  // Neighbors, with a slope.
  assert.notEqual(
    valueText(4e9, "uint32", { slope: 1e-7, intercept: 0 }),
    valueText(4e9 + 1, "uint32", { slope: 1e-7, intercept: 0 }),
  );
});

test("positions have the decimals that the distances need", () => {
  const at = (given, place) => positionTexts(volumeOf(given), placesOf(volumeOf(given)), place);
  assert.deepEqual(at({ spacing: [0.001234, 0.48828125, 2] }, [7, 7, 29]), ["0.008638", "3.41796875", "58"]);
  assert.deepEqual(at({ spacing: [0.1, 0.1, 0.1], origin: [-0.3, 100000, -1000] }, [3, 1, 2]), [
    "0",
    "100000.1",
    "-999.8",
  ]);
  assert.deepEqual(
    at(
      {
        space: "LPS",
        directions: [
          [0, 0.001234, 0],
          [0.5, 0, 0],
          [0, 0, -2],
        ],
        origin: [10, 0, 5],
      },
      [3, 5, 2],
    ),
    ["12.5", "0.003702", "1"],
  );
  assert.equal(at({}, [1, 2, 3]), undefined);
  assert.equal(placeText(1e-9, 1e-10), "1e-9");
  // Slices that lie where their own positions say.
  const uneven = {
    space: "LPS",
    directions: [
      [1, 0, 0],
      [0, 1, 0],
      [0, 0, 2],
    ],
    dims: [5, 5, 3],
    pairs: { slice_positions: "0 0 10; 0 0 12; 0 0 17.5" },
  };
  assert.deepEqual(at(uneven, [1, 2, 2]), ["1", "2", "17.5"]);
  assert.match(placesOf(volumeOf(uneven)).notes.join(), /unevenly spaced/);
  // Of other units along each axis, all positions are in millimeters.
  assert.deepEqual(at({ spacing: [1, 2, 3], fields: { units: '"mm" "cm" "um"' } }, [1, 1, 1]), ["1", "20", "0.003"]);
});

test("a notch of a wheel is a slice, whatever a browser makes of it", () => {
  const turn = (events) => {
    const slices = wheelSlices();
    return events.map(([deltaY, deltaMode = 0]) => slices({ deltaY, deltaMode }));
  };
  // Chromium, with and without a scaled display; Firefox in lines; a page; macOS.
  for (const notch of [
    [100],
    [120],
    [53],
    [-100],
    [-120],
    [-150],
    [3, 1],
    [-3, 1],
    [1, 1],
    [1, 2],
    [4.000244140625],
    [-12.000732421875],
  ])
    assert.deepEqual(turn(Array(20).fill(notch)), Array(20).fill(Math.sign(notch[0])), `${notch}`);
  // A touch pad: as many slices as it moves times 100 pixels, one at a time.
  const small = turn(Array(100).fill([6]));
  assert.equal(
    small.reduce((a, b) => a + b),
    6,
  );
  assert.ok(small.every((n) => n === 0 || n === 1));
  // Momentum that fades away never turns round, and a turn begins anew.
  const fading = turn([39, 35, 32, 28, 25, 20, 15, 10, 6, 3, 1, 1, 0].map((n) => [n]));
  assert.equal(
    fading.reduce((a, b) => a + b),
    2,
  );
  assert.deepEqual(turn([[39], [39], [-39], [-39], [-20], [-2]]), [0, 0, 0, 0, 0, -1]);
  // Wheels with fine steps: eight of them are a notch.
  for (const step of [[15], [12.5], [0.375, 1]])
    assert.equal(
      turn(Array(8).fill(step)).reduce((a, b) => a + b),
      1,
      `${step}`,
    );
});

const python = (code) => spawnSync(process.env.TAGRID_DEBIAN_PYTHON || "python3", ["-c", code], { encoding: "utf8" });
const hasNibabel = python("import nibabel").status === 0;
test("NIfTI files: nibabel names the same sides", { skip: hasNibabel ? false : "there is no nibabel" }, async () => {
  const { open } = await import(pathToFileURL(join(process.env.TAGRID_DIST, "index.js")));
  // Along axes, and turned by up to 40 degrees around each of them, half of them mirrored.
  const { stdout, status, stderr } = python(`
import json, math, random, numpy, nibabel
random.seed(7)
names = []
for i in range(24):
    turn = numpy.eye(3)
    for axis in range(3):
        a = math.radians(random.choice([0, 90, 180, 270]) + (random.uniform(-20, 20) if i % 2 else 0))
        b, c = [k for k in range(3) if k != axis]
        one = numpy.eye(3)
        one[b, b] = one[c, c] = math.cos(a)
        one[b, c], one[c, b] = -math.sin(a), math.sin(a)
        turn = turn @ one
    affine = numpy.eye(4)
    affine[:3, :3] = turn @ numpy.diag([random.choice([-1, 1]) * 0.7, 0.9, 2.5])
    affine[:3, 3] = [5, -20, 3]
    image = nibabel.Nifti1Image(numpy.zeros((4, 5, 6), numpy.int16), affine)
    image.header.set_xyzt_units("mm")
    nibabel.save(image, ${JSON.stringify(join(folder, "turned"))} + f"{i}.nii")
    names.append(nibabel.aff2axcodes(image.affine))
print(json.dumps(names))`);
  assert.equal(status, 0, stderr);
  const seen = new Set();
  for (const [i, names] of JSON.parse(stdout).entries()) {
    const path = join(folder, `turned${i}.tag`);
    tagrid("encode", join(folder, `turned${i}.nii`), "-q", "-o", path);
    const volume = await open(new Blob([readFileSync(path)]), { workers: 0 });
    const axes = axesOf(volume);
    const expected = names.map((name) => ({ S: "H", I: "F" })[name] ?? name);
    const nearest = [];
    // nibabel, too, gives each axis a side of its own.
    for (const [side, { axis, sign }] of nearestAxes(axes).entries())
      nearest[axis] = ["RL", "AP", "FH"][side][sign > 0 ? 1 : 0];
    assert.deepEqual(nearest, expected, `${i}`);
    if (i % 2 === 0) assert.deepEqual(axes.map(lettersOf), expected);
    seen.add(expected.join(""));
    volume.close();
  }
  assert.ok(seen.size > 12, [...seen].join(" "));
});
