"""Meshes of materials: their laws, computed with numpy, and that meshio takes them."""

import itertools
import sys
import tempfile
import unittest

import numpy as np
import tagrid

from volumes import module

SHAPE = (40, 36, 44)
RADIUS, MIDDLE = 13.0, np.array([20.0, 18.0, 21.0])  # z, y, x in voxels of 1 x 1 x 1


def ball():
    z, y, x = np.meshgrid(*(np.arange(n, dtype=float) for n in SHAPE), indexing="ij")
    return (RADIUS - np.sqrt((z - MIDDLE[0]) ** 2 + (y - MIDDLE[1]) ** 2 + (x - MIDDLE[2]) ** 2)).astype(np.float32)


def six_volumes(mesh):
    a, b, c, d = (mesh.points[mesh.cells[:, i]] for i in range(4))
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a))


def faces_of(cells):
    return [tuple(sorted(cell[list(corners)])) for cell in cells for corners in itertools.combinations(range(4), 3)]


class Materials(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.volume = tagrid.open(tagrid.encode(ball(), cube=8, brick=1))
        cls.named = {"out": (None, 0), "ball": (0, None)}

    def test_the_surface_is_that_of_the_ball(self):
        mesh = self.volume.mesh(materials=self.named, size=2)
        self.assertEqual(mesh.groups["ball"].stop, len(mesh.cells))
        for name, number in (("out", 1), ("ball", 2)):
            np.testing.assert_array_equal(np.unique(mesh.materials[mesh.groups[name]]), [number])
        on = mesh.points[np.unique(mesh.surfaces["out_ball"])]
        far = np.abs(np.linalg.norm(on - MIDDLE[::-1], axis=1) - RADIUS)
        self.assertLess(far.max(), 0.1)
        seen, counts = np.unique(np.array(faces_of(mesh.cells[mesh.groups["ball"]])), axis=0, return_counts=True)
        border = {tuple(face) for face in seen[counts == 1]}
        self.assertEqual(border, {tuple(sorted(face)) for face in mesh.surfaces["out_ball"]})
        self.assertEqual(set(mesh.surfaces), {"out_ball"} | {f"out_{a}_{e}" for a in "xyz" for e in ("min", "max")})
        # Normals point out of the first material, so into the ball.
        a, b, c = (mesh.points[mesh.surfaces["out_ball"][:, i]] for i in range(3))
        self.assertLess(np.einsum("ij,ij->i", np.cross(b - a, c - a), (a + b + c) / 3 - MIDDLE[::-1]).max(), 0)

    def test_labels(self):
        labels = np.where(ball() >= 0, 7, 0).astype(np.uint8)
        labels[:, :, :5] = 3
        volume = tagrid.open(tagrid.encode(labels))
        mesh = volume.mesh(labels=True, size=2)
        self.assertEqual(list(mesh.groups), ["label_3", "label_7"])
        self.assertEqual(set(mesh.materials), {3, 7})
        named = volume.mesh(labels={7: "seven"}, size=2, smooth=0)
        self.assertEqual(list(named.groups), ["seven"])
        self.assertIn("seven_label_0", named.surfaces)
        size = six_volumes(named).sum() / 6
        self.assertAlmostEqual(size / np.count_nonzero(labels == 7), 1, delta=0.03)

    def test_parts_and_regions(self):
        mesh = self.volume.mesh(materials={"ball": (0, None)}, size=2, region=((0, 20), (0, 36), (0, 44)))
        whole = self.volume.mesh(materials={"ball": (0, None)}, size=2)
        tetrahedra = {tuple(map(tuple, np.sort(whole.points[cell], axis=0))) for cell in whole.cells}
        self.assertTrue(all(tuple(map(tuple, np.sort(mesh.points[cell], axis=0))) in tetrahedra for cell in mesh.cells))
        self.assertIn("ball_cut", mesh.surfaces)
        with self.assertRaisesRegex(tagrid.ArgumentError, "no part of ball is large enough"):
            self.volume.mesh(materials={"ball": (0, None)}, size=2, parts=1e6)

    def test_arguments(self):
        cases = [(dict(materials=self.named, labels=True), tagrid.ArgumentError, "give one of them"),
                 (dict(size=3), tagrid.ArgumentError, "give materials or labels"),
                 (dict(materials={"a b": (1, 2)}), tagrid.ArgumentError, "'a b' is not a name"),
                 (dict(materials={"a": 3}), TypeError, "must be a pair"),
                 (dict(materials={"a": (3, 1)}), tagrid.ArgumentError, "no values from 3 to 1"),
                 (dict(materials={"a": (None, None)}), tagrid.ArgumentError, "of one material"),
                 (dict(materials=self.named, smooth=1), tagrid.ArgumentError, "only to labels"),
                 (dict(materials=self.named, angles=12), tagrid.ArgumentError, "9 or 15"),
                 (dict(materials=self.named, order=3), tagrid.ArgumentError, "1 or 2"),
                 (dict(materials=self.named, size=-1), tagrid.ArgumentError, "greater than 0"),
                 (dict(materials=self.named, size=1000), tagrid.ArgumentError, "smaller size"),
                 (dict(materials=self.named, parts="all"), tagrid.ArgumentError, "largest"),
                 (dict(materials=self.named, level=3), tagrid.ArgumentError, "about the grid"),
                 (dict(labels=True), tagrid.ArgumentError, "integers"),
                 (dict(materials=self.named, memory_limit=1), tagrid.MemoryLimitError, "")]
        for arguments, error, text in cases:
            with self.subTest(arguments), self.assertRaises(error) as raised:
                self.volume.mesh(**arguments)
            self.assertIn(text, str(raised.exception))

    def test_progress_may_end_it(self):
        seen = []

        def stop(done, total):
            seen.append((done, total))
            raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):
            self.volume.mesh(materials=self.named, progress=stop)
        self.assertEqual(len(seen), 1)

    def test_progress_counts_bricks(self):
        seen = []
        self.volume.mesh(materials=self.named, size=0.5, progress=lambda done, total: seen.append((done, total)))
        self.assertGreater(len(seen), 3)
        self.assertEqual(seen, [(done, len(seen)) for done in range(1, len(seen) + 1)])

    def test_meshio_has_sets(self):
        module("meshio")
        for order in (1, 2):
            mesh = self.volume.mesh(materials=self.named, size=3, order=order)
            other = mesh.meshio()
            self.assertEqual(other.cells[0].type, "tetra" if order == 1 else "tetra10")
            for name, cells in mesh.groups.items():
                np.testing.assert_array_equal(other.cells[0].data[other.cell_sets[name][0]], mesh.cells[cells])
            blocks = {name: [block.data[chosen] for block, chosen in zip(other.cells, other.cell_sets[name]) if len(chosen)]
                      for name in mesh.surfaces}
            for name, triangles in mesh.surfaces.items():
                np.testing.assert_array_equal(blocks[name][0], triangles)
                self.assertEqual(len(blocks[name]), 1)

    def test_gmsh_finds_the_groups_that_meshio_wrote(self):
        try:
            import gmsh
            import meshio  # noqa: F401
        except ImportError as missing:
            self.skipTest(f"{missing.name} is not installed")
        mesh = self.volume.mesh(materials=self.named, size=3)
        with tempfile.TemporaryDirectory() as folder:
            mesh.meshio().write(f"{folder}/a.msh", file_format="gmsh22")
            gmsh.initialize()
            self.addCleanup(gmsh.finalize)
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.open(f"{folder}/a.msh")
        found = {}
        for dimension, tag in gmsh.model.getPhysicalGroups():
            entities = gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)
            numbers = [gmsh.model.mesh.getElements(dimension, entity)[1][0] for entity in entities]
            found[gmsh.model.getPhysicalName(dimension, tag)] = sum(map(len, numbers))
        wanted = {name: cells.stop - cells.start for name, cells in mesh.groups.items()}
        self.assertEqual(found, wanted | {name: len(triangles) for name, triangles in mesh.surfaces.items()})

    def test_a_mesh_of_nothing_is_an_error(self):
        with self.assertRaisesRegex(tagrid.ArgumentError, "would be empty: no tetrahedron is of a; values are from"):
            self.volume.mesh(materials={"a": (5000, None)})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
