"""The Python module against a small sequence that DejaVu makes: test_palpate.py PROGRAM SOURCE WORK"""

import gc
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path

import numpy as np
import palpate

PROGRAM, SOURCE, WORK = Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3])


def checkerboard(height=48, width=64):
    return np.random.default_rng(1).integers(0, 256, (height, width, 3), dtype=np.uint8)


class Estimated:
    """A whole run, made once."""

    def __init__(self):
        folder = WORK / "sequence"
        if not (folder / "truth.csv").exists():
            subprocess.run(
                [PROGRAM, "simulate", SOURCE / "tests/python/pull.yaml", "-o", folder, "--json"],
                check=True,
                stdout=subprocess.DEVNULL,
            )
        self.folder = folder
        self.scene = palpate.Scene.read(folder / "scene.yaml")
        recording = palpate.Recording(self.scene.recording)
        self.rectification = palpate.make_rectification(palpate.read_rig(self.scene.recording), recording.size)
        self.rest = next(recording)
        self.map = palpate.build_tissue_map(
            self.rest, self.rectification, self.scene.map, self.scene.tissue, self.scene.attachments
        )
        self.estimator = self.new_estimator()
        self.frames = list(recording)
        self.estimates = [self.estimator.update(frame) for frame in self.frames]

    def new_estimator(self):
        return palpate.ForceEstimator(
            self.map, self.rest, self.rectification, self.scene.instrument, self.scene.contact, self.scene.tuning
        )


class Sequence(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.run_ = Estimated()

    def in_contact(self):
        return next(estimate for estimate in self.run_.estimates if estimate.status == "ok")

    def test_answers_as_the_program_does(self):
        results = WORK / "results"
        subprocess.run(
            [PROGRAM, "estimate", self.run_.folder / "scene.yaml", "-o", results, "--json"],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        rows = np.genfromtxt(results / "forces.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
        rows = rows[1:]  # the first frame is the map's
        self.assertEqual(
            [str(status) for status in rows["status"]], [estimate.status for estimate in self.run_.estimates]
        )
        force_N = np.array([estimate.force_N for estimate in self.run_.estimates])
        np.testing.assert_allclose(np.stack([rows["fx_N"], rows["fy_N"], rows["fz_N"]], axis=1), force_N, atol=2e-3)

    def test_results_are_views_that_keep_their_owner(self):
        estimate = self.run_.new_estimator().update(self.run_.frames[0])
        views = [
            self.in_contact().force_N,
            self.in_contact().deformed_nodes_mm,
            self.run_.map.mesh.nodes_mm,
            estimate.tip_mm,
        ]
        copies = [view.copy() for view in views]
        del estimate
        gc.collect()
        for view, copy in zip(views, copies):
            self.assertIsNotNone(view.base)
            np.testing.assert_array_equal(view, copy)

    def test_a_view_outlives_every_name_of_its_owner(self):
        nodes = palpate.tetrahedralize(octahedron(), 200).nodes_mm
        kept = nodes.copy()
        [np.zeros(nodes.shape) for _ in range(100)]
        gc.collect()
        np.testing.assert_array_equal(nodes, kept)

    def test_shapes(self):
        estimate, tissue_map = self.in_contact(), self.run_.map
        width, height = self.run_.rectification.size
        nodes = len(estimate.deformed_nodes_mm)
        self.assertEqual(estimate.force_N.shape, (3,))
        self.assertEqual(estimate.stiffness_N_per_mm.shape, (3, 3))
        self.assertEqual(estimate.deformed_nodes_mm.shape, (nodes, 3))
        self.assertEqual(estimate.node_von_mises_kPa.shape, (nodes,))
        self.assertLess(estimate.boundary.max(), nodes)
        self.assertAlmostEqual(
            estimate.node_von_mises_kPa.max(), estimate.max_von_mises_kPa, delta=0.5 * estimate.max_von_mises_kPa
        )
        self.assertEqual(tissue_map.organ_mask.shape, (height, width))
        self.assertEqual(tissue_map.mesh.tetrahedra.shape[1], 4)
        self.assertEqual(tissue_map.cloud.colour.shape, tissue_map.cloud.position_mm.shape)
        self.assertGreater(len(tissue_map.fixed_nodes), 0)
        self.assertEqual(self.run_.rest.left.shape, (height, width, 3))

    def test_the_readme_shows_the_example_that_runs_here(self):
        example = SOURCE / "examples/forces.py"
        self.assertIn("```python\n" + example.read_text() + "```", (SOURCE / "README.md").read_text())
        said = subprocess.run(
            [sys.executable, example, self.run_.folder / "scene.yaml"], check=True, capture_output=True, text=True
        ).stdout.splitlines()
        self.assertEqual([line.split()[1] for line in said], [estimate.status for estimate in self.run_.estimates])

    def test_results_cannot_be_written(self):
        for array in (self.in_contact().force_N, self.run_.map.mesh.nodes_mm, self.run_.rest.left):
            with self.assertRaisesRegex(ValueError, "^assignment destination is read-only$"):
                array[0] = 0

    def test_frames_made_of_arrays_answer_as_the_recorded_ones(self):
        estimator = self.run_.new_estimator()
        for frame, expected in zip(self.run_.frames, self.run_.estimates):
            wide = np.zeros((frame.left.shape[0], 2 * frame.left.shape[1], 3), np.uint8)
            wide[:, ::2] = frame.left
            again = palpate.StereoFrame(wide[:, ::2], frame.right[::-1].copy()[::-1], frame.index, frame.time_s)
            np.testing.assert_allclose(estimator.update(again).force_N, expected.force_N, rtol=1e-4, atol=1e-4)  # sums of several threads

    def test_other_threads_go_on_while_it_works(self):
        turns, done = 0, threading.Event()

        def build():
            palpate.build_tissue_map(
                self.run_.rest,
                self.run_.rectification,
                self.run_.scene.map,
                self.run_.scene.tissue,
                self.run_.scene.attachments,
            )
            done.set()

        worker = threading.Thread(target=build)
        worker.start()
        while not done.is_set():
            turns += 1
            time.sleep(1e-3)
        worker.join()
        self.assertGreater(turns, 5)

    def test_a_frame_of_another_size_is_refused(self):
        with self.assertRaisesRegex(palpate.BadInput, r"^frame 3 is 64 x 48 px, and the recording \d+ x \d+ px$"):
            self.run_.estimator.update(palpate.StereoFrame(checkerboard(), checkerboard(), index=3))

    def test_uncertainty_widens_the_band(self):
        uncertainty = palpate.UncertaintyOptions()
        uncertainty.young_modulus_factor = 1.3
        known = palpate.force_uncertainty(self.run_.map, self.run_.rectification, self.run_.scene.map, uncertainty, 2.0)
        estimator = palpate.ForceEstimator(
            self.run_.map,
            self.run_.rest,
            self.run_.rectification,
            self.run_.scene.instrument,
            self.run_.scene.contact,
            uncertainty=known,
        )
        estimates = [estimator.update(frame) for frame in self.run_.frames]
        estimate = next(estimate for estimate in estimates if estimate.status == "ok")
        self.assertGreater(estimate.total_band.high_N, estimate.band.high_N)

    def test_meshes_go_to_meshio_and_come_back(self):
        import meshio

        meshio.write(WORK / "map.vtu", palpate.to_meshio(self.run_.map))
        read = meshio.read(WORK / "map.vtu")
        self.assertEqual(int(read.point_data["fixed"].sum()), len(self.run_.map.fixed_nodes))
        again = palpate.from_meshio(read)
        np.testing.assert_array_equal(again.tetrahedra, self.run_.map.mesh.tetrahedra)
        np.testing.assert_allclose(again.nodes_mm, self.run_.map.mesh.nodes_mm)
        surface = palpate.from_meshio(palpate.to_meshio(self.run_.map.surface))
        np.testing.assert_array_equal(surface.triangles, self.run_.map.surface.triangles)
        stress = palpate.to_meshio(self.in_contact()).point_data["von_mises_kPa"]
        np.testing.assert_array_equal(stress, self.in_contact().node_von_mises_kPa)
        with self.assertRaisesRegex(palpate.BadInput, "neither tetrahedra nor triangles, but line"):
            palpate.from_meshio(meshio.Mesh(np.zeros((2, 3)), [("line", np.array([[0, 1]]))]))


def octahedron(radius_mm=20.0):
    corners = radius_mm * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    return palpate.Surface(
        corners, np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    )


class Inputs(unittest.TestCase):
    def test_a_wrong_array_gets_one_sentence(self):
        good = checkerboard()
        for bad, said in (
            (good.astype(float), r"^left: expected uint8 \(height, width, 3\), BGR, got float64 \(48, 64, 3\)$"),
            (good[..., 0], r"^left: expected uint8 \(height, width, 3\), BGR, got uint8 \(48, 64\)$"),
            (np.zeros((0, 64, 3), np.uint8), r"^left: expected .* got uint8 \(0, 64, 3\)$"),
        ):
            with self.assertRaisesRegex(palpate.BadInput, said):
                palpate.StereoFrame(bad, good)
        with self.assertRaisesRegex(palpate.BadInput, "^left and right differ in size$"):
            palpate.StereoFrame(good, good[:, :32])
        points = np.eye(4, 3)
        with self.assertRaisesRegex(
            palpate.BadInput, r"^triangles: expected whole numbers \(n, 3\), got float64 \(1, 3\)$"
        ):
            palpate.Surface(points, np.array([[0.0, 1.0, 2.0]]))
        with self.assertRaisesRegex(palpate.BadInput, "^triangles: 4 is no number of the 4 points$"):
            palpate.Surface(points, np.array([[0, 1, 4]]))
        with self.assertRaisesRegex(palpate.BadInput, "^vertices_mm: row 2 is not finite$"):
            palpate.Surface(np.array([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]]), np.array([[0, 1, 2]]))
        with self.assertRaisesRegex(palpate.BadInput, "^tetrahedra: row 0 has no positive volume$"):
            palpate.TetMesh(points, np.array([[0, 1, 2, 3]]))

    def test_arrays_that_cannot_be_written_are_taken(self):
        good = checkerboard()
        good.setflags(write=False)
        np.testing.assert_array_equal(palpate.StereoFrame(good, good).left, good)

    def test_a_frame_holds_a_copy(self):
        image = checkerboard()
        frame = palpate.StereoFrame(image, image)
        before = frame.left.copy()
        image[:] = 0
        np.testing.assert_array_equal(frame.left, before)

    def test_errors_have_kinds(self):
        self.assertTrue(issubclass(palpate.BadInput, ValueError))
        self.assertTrue(issubclass(palpate.Unfinished, RuntimeError))
        with self.assertRaisesRegex(palpate.BadInput, "none.yaml does not exist"):
            palpate.Scene.read("none.yaml")
        with self.assertRaisesRegex(ValueError, "^law: 'jelly' is none of saint-venant-kirchhoff, saint-venant-kirchhoff-barrier"):
            palpate.TissueOptions().law = "jelly"

    def test_options_are_read_and_written(self):
        scene = palpate.Scene()
        scene.map.thickness_mm = 12.5
        scene.map.organ_region_px = [(1, 2), (30, 2), (30, 20)]
        scene.tissue.law = "neo-hookean"
        self.assertEqual(scene.map.organ_region_px[1], (30, 2))
        self.assertIn("thickness_mm: 12.5", str(scene.map))
        self.assertIn("law: neo-hookean", str(scene))

    def test_a_rig_is_made_of_what_opencv_returns(self):
        K = np.array([[700, 0, 31.5], [0, 700, 23.5], [0, 0, 1.0]])
        rig = palpate.StereoRig(
            K, np.zeros((1, 5)), K, np.zeros((1, 5)), np.eye(3), np.array([[-5.0], [0], [0]]), (64, 48)
        )
        self.assertEqual(rig.baseline_mm, 5)
        np.testing.assert_array_equal(rig.left_K, K)
        self.assertAlmostEqual(palpate.make_rectification(rig, (64, 48)).focal_px, 700)
        with self.assertRaisesRegex(palpate.BadInput, "^right_from_left: is not a rotation$"):
            palpate.StereoRig(K, np.zeros(5), K, np.zeros(5), 2 * np.eye(3), np.array([-5.0, 0, 0]), (64, 48))

    def test_everything_public_is_documented(self):
        for name in palpate.__all__:
            self.assertTrue(getattr(palpate, name).__doc__, name)
        for name, member in vars(palpate.ForceEstimate).items():
            if name.endswith(("_N", "_mm", "_kPa", "_s", "_ms")):
                self.assertRegex(member.__doc__ or "", r"(N|mm|kPa|s|ms)\b", name)

    def test_it_has_the_programs_version(self):
        version = subprocess.run([PROGRAM, "--version"], check=True, capture_output=True, text=True).stdout.strip()
        self.assertEqual(palpate.__version__, version)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
