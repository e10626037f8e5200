"""What the tests of HDF5 and VTKHDF files share: volumes that are decoded into them."""

from other_readers import ReaderTest, h5py, random_samples

OBLIQUE = ((0.4, 0.3, 0), (-0.3, 0.4, 0), (0, 0, 2.5))
SHEARED = ((0.5, 0, 0), (0, 0.5, 0), (0.1, 0.2, 2.5))
MIRRORED = ((-0.5, 0, 0), (0, 0, 0.25), (0, 3, 0))
PLACES = {"hdf5": "/volume", "vtkhdf": "/VTKHDF/PointData/value"}
FORMATS = {"b.h5": "hdf5", "b.vtkhdf": "vtkhdf"}


def placed(directions, origin=(10, -20, 30.5), space="left-posterior-superior"):
    return (f"space: {space}\n" if space else "space dimension: 3\n") + \
        f"space directions: {' '.join('(' + ','.join(map(str, d)) + ')' for d in directions)}\n" + \
        f"space origin: ({','.join(map(str, origin))})\n" + 'space units: "mm" "mm" "mm"\n'


class Hdf5Test(ReaderTest):
    def encode(self, type="int16", shape=(5, 19, 23), fields="", name="a"):
        """Makes NAME.nrrd and NAME.tag; returns the samples."""
        samples = random_samples(type, shape)
        self.write_nrrd(f"{name}.nrrd", samples, fields)
        self.ok("encode", f"{name}.nrrd", "-o", f"{name}.tag", "-f", "--range", "auto")
        return samples

    def decode(self, name, *options, tag="a.tag"):
        return self.ok("decode", tag, "-o", name, "-f", *options).stderr

    def nrrd_of(self, tag):
        self.decode(f"{tag}.nrrd", tag=tag)
        return (self.folder / f"{tag}.nrrd").read_bytes()

    def assert_comes_back(self, name, what="", said=""):
        """What is encoded from the file is the volume that was decoded into it: every header line, and every voxel. Messages have
        the text `said`; there are none if it is empty."""
        before = self.nrrd_of("a.tag")
        run = self.tagrid("encode", name, "-o", "again.tag", "-f", "--range", "auto")
        # spacing_test.py has what is said of volumes without a voxel size or its unit.
        messages = "".join(line for line in run.stderr.splitlines(keepends=True) if "add it with --spacing" not in line)
        self.assertEqual((run.returncode, messages if not said or said not in messages else said), (0, said), what)
        self.assertEqual(self.nrrd_of("again.tag"), before, what)

    def dataset(self, name):
        file = h5py.File(self.folder / name, "r")
        self.addCleanup(file.close)
        return file[PLACES[FORMATS[name]]]
