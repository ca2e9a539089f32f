#!/usr/bin/python3
"""Tests the parts of the training: azimuths, augmentation, assignment, losses, scores, export."""

import json
import math
import sys
import tempfile
import unittest
from pathlib import Path

try:
    import numpy as np
    import onnx
    import torch
    from PIL import Image
except ImportError as missing:
    print(f"skipped: {missing.name} is not installed (deploy/install --train)")
    sys.exit(77)

from perdure_train import augment, data, export, heads, losses, release, scores, simulated
from perdure_train.network import Network
from perdure_train.settings import CLASSES, REACH, STRIDES, grid

torch.set_num_threads(1)


def level_camera(yaw):
    """Returns R_WC of a camera that looks along (cos yaw, sin yaw, 0) with its x axis to the
    right."""
    forward = np.array([math.cos(yaw), math.sin(yaw), 0])
    right = np.array([forward[1], -forward[0], 0])
    return np.stack([right, [0, 0, -1], forward], axis=1)


def truth_of(boxes, classes, azimuths=None, ignored=None):
    n = len(boxes)
    return {"boxes": np.array(boxes, np.float32).reshape(-1, 4),
            "classes": np.array(classes, np.int64),
            "azimuths": np.array(azimuths or [0.0] * n, np.float32),
            "ignored": np.array(ignored or [False] * n, bool)}


class Azimuth(unittest.TestCase):
    def test_a_car_ahead_that_drives_away_has_minus_a_quarter_turn_as_in_kitti(self):
        alpha = simulated.azimuth(level_camera(0.7), np.zeros(3), [math.cos(0.7), math.sin(0.7), 0], 0.7)
        self.assertAlmostEqual(alpha, -math.pi / 2)

    def test_a_car_ahead_that_points_right_has_none(self):
        alpha = simulated.azimuth(level_camera(0.0), np.zeros(3), [5, 0, 0], -math.pi / 2)
        self.assertAlmostEqual(alpha, 0.0)

    def test_it_is_what_is_seen_wherever_the_camera_looks(self):
        looks = [simulated.azimuth(level_camera(yaw), np.zeros(3), [5, 2, 0], 1.1) for yaw in (0, 0.3, -0.4)]
        self.assertAlmostEqual(looks[0], looks[1])
        self.assertAlmostEqual(looks[0], looks[2])

    def test_roll_and_pitch_do_not_change_it(self):
        upright = level_camera(0.2)
        c, s = math.cos(0.6), math.sin(0.6)
        rolled = upright @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        pitched = upright @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        expected = simulated.azimuth(upright, np.zeros(3), [5, 2, 0], 1.1)
        self.assertAlmostEqual(simulated.azimuth(rolled, np.zeros(3), [5, 2, 0], 1.1), expected)
        self.assertAlmostEqual(simulated.azimuth(pitched, np.zeros(3), [5, 2, 0], 1.1), expected)

    def test_the_true_angle_costs_no_residual(self):
        angle = torch.tensor([1.3])
        raw = torch.zeros(1, 24)
        for i in range(12):
            raw[0, 12 + i] = heads.wrapped(angle - i * 2 * heads.HALF_BIN) / heads.HALF_BIN
        _, residual = losses.azimuth_loss(raw, angle, torch.ones(1))
        self.assertAlmostEqual(float(residual), 0.0, places=5)


class Truth(unittest.TestCase):
    def test_what_is_hidden_small_or_outside_is_not_to_be_found(self):
        def row(seen, *box):
            return ["0", "1", str(seen), *map(str, box)]

        self.assertIsNone(simulated.judged(row(0.03, 10, 10, 90, 90), np.ones(4)))
        self.assertIsNone(simulated.judged(row(1.0, 330, 10, 390, 90), np.ones(4)))
        self.assertTrue(simulated.judged(row(0.2, 10, 10, 90, 90), np.ones(4))[1])
        self.assertTrue(simulated.judged(row(1.0, 10, 10, 18, 18), np.ones(4))[1])
        self.assertFalse(simulated.judged(row(1.0, 10, 10, 30, 40), np.ones(4))[1])

    def test_an_object_cut_by_the_border_counts_by_what_is_inside(self):
        box, ignored = simulated.judged(["0", "1", "0.2", "-160", "0", "40", "100"], np.ones(4))
        self.assertFalse(ignored)
        np.testing.assert_array_equal(box, [0, 0, 40, 100])

    def test_the_mirror_turns_boxes_and_azimuths(self):
        image = np.zeros((240, 320, 3), np.uint8)
        image[20:40, 10:30] = 255
        mirrored, truth = augment.mirrored(image, truth_of([[10, 20, 30, 40]], [0], [0.4]))
        np.testing.assert_allclose(truth["boxes"], [[290, 20, 310, 40]])
        self.assertTrue((mirrored[20:40, 290:310] == 255).all())
        self.assertAlmostEqual(float(truth["azimuths"][0]), math.pi - 0.4, places=5)

    def test_a_crop_keeps_the_box_on_its_object(self):
        image = np.zeros((240, 320, 3), np.uint8)
        image[100:140, 130:190] = 255
        tried = 0
        for seed in range(20):
            cut, truth = augment.crop(image, truth_of([[130, 100, 190, 140]], [0]), np.random.default_rng(seed))
            if not len(truth["boxes"]):
                continue
            tried += 1
            on = np.argwhere(cut[:, :, 0] > 230)
            x1, y1, x2, y2 = truth["boxes"][0]
            self.assertLess(abs(on[:, 1].min() - x1) + abs(on[:, 1].max() + 1 - x2), 5)
            self.assertLess(abs(on[:, 0].min() - y1) + abs(on[:, 0].max() + 1 - y2), 5)
        self.assertGreater(tried, 10)

    def test_the_same_look_is_the_same_picture(self):
        image = np.random.default_rng(0).integers(0, 255, (240, 320, 3), np.uint8)
        one = augment.augmented(image, truth_of([[10, 20, 60, 70]], [0]), np.random.default_rng(3))
        two = augment.augmented(image, truth_of([[10, 20, 60, 70]], [0]), np.random.default_rng(3))
        np.testing.assert_array_equal(one[0], two[0])

    def test_looks_go_on_where_a_run_was_broken_off(self):
        whole = iter(data.Looks(10, 4, 0, 5))
        batches = [next(whole) for _ in range(6)]
        self.assertEqual(next(iter(data.Looks(10, 4, 12, 5))), batches[3])


class Learning(unittest.TestCase):
    def setUp(self):
        torch.manual_seed(0)
        self.centres, self.strides = heads.cells()

    def batch(self):
        samples = [(np.zeros((240, 320, 3), np.uint8),
                    truth_of([[100, 60, 180, 140], [20, 20, 60, 60]], [0, 4], ignored=[False, True]))]
        return data.batch_of(samples)

    def test_cells_cover_the_input_in_the_order_of_the_heads(self):
        images, _ = self.batch()
        with torch.no_grad():
            parts = heads.flat(Network().eval()(data.as_input(images)))
        self.assertEqual(parts[0].shape, (1, len(self.centres), len(CLASSES) + 1))
        self.assertEqual(len(self.centres), sum(r * c for r, c in map(grid, STRIDES)))

    def test_cells_of_an_object_are_chosen_inside_it_and_none_for_an_ignored_one(self):
        _, truth = self.batch()
        a = len(self.centres)
        boxes = torch.cat((self.centres - 30, self.centres + 30), 1)[None]
        quality, owner = losses.assign(torch.full((1, a, len(CLASSES) + 1), 0.1), boxes, self.centres, self.strides, truth)
        chosen = quality[0] > 0
        self.assertTrue(0 < int(chosen.sum()) <= losses.TOP)
        inside = losses.inside(self.centres, truth["boxes"], REACH * self.strides)[0, 0]
        self.assertTrue(bool(inside[chosen].all()))
        self.assertTrue(bool((owner[0][chosen] == 0).all()))

    def test_an_object_smaller_than_a_cell_has_a_cell_wherever_it_is(self):
        for x in np.arange(100, 108, 0.7):
            box = torch.tensor([[[x, 60.5, x + 3, 62.5]]], dtype=torch.float32)
            self.assertTrue(bool(losses.inside(self.centres, box, REACH * self.strides).any()))

    def test_boxes_whose_sides_have_passed_each_other_have_no_area(self):
        box = torch.tensor([[10.0, 10, 4, 4]])
        self.assertEqual(float(heads.area(box)), 0.0)
        self.assertEqual(float(heads.iou(box, torch.tensor([[0.0, 0, 20, 20]]))), 0.0)

    def test_spread_is_cheapest_at_the_mean_error(self):
        target = torch.tensor([[10.0, 10, 50, 60]])
        raw = torch.linspace(-3, 3, 200)
        costs = [float(losses.spread_loss(torch.full((1, 4), float(r)), target + 8, target,
                                          torch.tensor([8.0]), torch.ones(1))) for r in raw]
        best = heads.spread_of(raw[int(np.argmin(costs))])
        self.assertAlmostEqual(float(best), 1.0, delta=0.05)

    def test_exact_boxes_cost_nothing_and_shifted_ones_do(self):
        box = torch.tensor([[10.0, 10, 50, 60]])
        exact = losses.box_loss(box, box, torch.tensor([8.0]), torch.ones(1))
        shifted = losses.box_loss(box + 8, box, torch.tensor([8.0]), torch.ones(1))
        self.assertAlmostEqual(float(exact[0]), 0.0, places=5)
        self.assertGreater(float(shifted[0]), 0.2)
        self.assertGreater(float(shifted[1]), 0.2)

    def test_giou_is_that_of_the_paper(self):
        a, b = torch.tensor([[0.0, 0, 10, 10]]), torch.tensor([[20.0, 0, 30, 10]])
        giou, _ = losses.box_loss(a, b, torch.tensor([8.0]), torch.ones(1))
        self.assertAlmostEqual(float(giou), 1 + 100 / 300, places=5)

    def test_a_step_against_the_gradient_lowers_the_loss(self):
        images, truth = self.batch()
        network = Network()
        search = torch.optim.SGD(network.parameters(), lr=1e-3)
        values = []
        for _ in range(6):
            terms = losses.losses(heads.flat(network(data.as_input(images))), truth, self.centres, self.strides)
            search.zero_grad()
            sum(terms.values()).backward()
            search.step()
            values.append(float(sum(terms.values())))
        self.assertLess(values[-1], values[0])


class Scores(unittest.TestCase):
    def frame(self, boxes, p, truth):
        p = np.array(p, float).reshape(-1, len(CLASSES))
        return ({"boxes": np.array(boxes, float).reshape(-1, 4), "p": p, "odds": p,
                 "azimuths": np.full((len(p), 2), math.nan)}, truth)

    def likely(self, k, p):
        return [p if i == k else 0.001 for i in range(len(CLASSES))]

    def test_average_precision_of_a_known_ranking(self):
        self.assertAlmostEqual(
            scores.average_precision(np.array([0.9, 0.8, 0.7]), np.array([True, False, True]), 2),
            0.5 * 1 + 0.5 * 2 / 3)

    def test_a_second_box_on_one_object_is_a_false_alarm_and_one_on_an_ignored_is_not(self):
        truth = truth_of([[0, 0, 40, 40], [100, 100, 140, 140]], [0, 0], ignored=[False, True])
        boxes = [[0, 0, 40, 40], [1, 1, 41, 41], [100, 100, 140, 140]]
        got = scores.match(np.array(boxes, float), np.array([0.9, 0.8, 0.95]), truth["boxes"], ~truth["ignored"])
        self.assertEqual(got.tolist(), [0, -1, -2])

    def test_perfect_detections_score_one_in_every_size(self):
        truth = truth_of([[0, 0, 40, 40]], [0])
        frames = [self.frame([[0, 0, 40, 40]], [self.likely(0, 0.9)], truth)]
        self.assertEqual(scores.class_average_precision(frames, 0), (1.0, 1))
        self.assertEqual(scores.class_average_precision(frames, 0, scores.SIZES["medium"]), (1.0, 1))
        self.assertEqual(scores.recall(frames, 0, 24), (1, 1))

    def test_ratios_of_sides_are_errors_over_what_is_said_of_them(self):
        truth = truth_of([[100, 100, 140, 140]], [0])
        detections, _ = self.frame([[102, 100, 140, 144]], [self.likely(0, 0.9)], truth)
        detections["sigmas"] = np.array([[4.0, 1.0, 1.0, 2.0]])
        np.testing.assert_allclose(scores.side_ratios([(detections, truth)]), [0.5, 0, 0, 2])

    def test_calibration_error_is_the_gap_between_confidence_and_success(self):
        p = np.array([self.likely(0, 0.8)] * 10)
        labels = np.array([1] * 5 + [0] * 5)
        self.assertAlmostEqual(scores.calibration_error(p, labels), 0.3)

    def test_calibration_finds_the_temperature_and_shift_that_made_the_labels(self):
        rng = np.random.default_rng(1)
        odds = rng.normal(0, 3, (20000, len(CLASSES)))
        p = scores.probabilities(odds, 1.7, -0.5)
        draws = rng.random(len(p))[:, None]
        labels = (draws > np.cumsum(np.concatenate([1 - p.sum(1, keepdims=True), p], 1), 1)).sum(1)
        temperature, shift = release.fit_calibration(odds, labels)
        self.assertAlmostEqual(temperature, 1.7, delta=0.08)
        self.assertAlmostEqual(shift, -0.5, delta=0.08)


class Export(unittest.TestCase):
    def test_the_file_is_small_and_its_tensors_are_those_of_the_description(self):
        torch.manual_seed(0)
        network = Network()
        self.assertLess(abs(sum(p.numel() for p in network.parameters()) - 500_000), 50_000)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "n.onnx"
            export.write_onnx(network, path)
            self.assertLessEqual(path.stat().st_size, 2_000_000)
            model = onnx.load(str(path))
            export.write_onnx(network, path, size=(480, 360))
            wide = onnx.load(str(path))
        self.assertNotIn("Identity", {node.op_type for node in model.graph.node})
        wanted = [level[part] for level in release.description()["levels"] for part in ("logits", "box", "azimuth", "spread")]
        self.assertEqual([output.name for output in model.graph.output], wanted)
        self.assertEqual([d.dim_value for d in wide.graph.input[0].type.tensor_type.shape.dim], [1, 3, 360, 480])

    def test_folding_the_batch_norm_changes_no_answer(self):
        torch.manual_seed(0)
        network = Network()
        for m in network.modules():
            if isinstance(m, torch.nn.BatchNorm2d):
                m.running_mean.normal_(0, 0.3)
                m.running_var.uniform_(0.5, 2)
        network.eval()
        images = torch.randn(1, 3, 240, 320)
        with torch.no_grad():
            for a, b in zip(heads.flat(network(images)), heads.flat(export.folded(network)(images))):
                self.assertLess(float((a - b).abs().max()), 1e-3)

    def test_bf16_relu_has_the_gradient_of_relu(self):
        from perdure_train.network import ReLU
        x = torch.randn(1000).to(torch.bfloat16)
        x[:3] = torch.tensor([0.0, -0.0, 1e-30])
        mine, theirs = x.clone().requires_grad_(), x.clone().requires_grad_()
        weight = torch.randn(1000).to(torch.bfloat16)
        (ReLU()(mine) * weight).sum().backward()
        (torch.relu(theirs) * weight).sum().backward()
        self.assertTrue(torch.equal(mine.grad.abs(), theirs.grad.abs()))
        self.assertTrue(torch.equal(mine.grad[x > 0], theirs.grad[x > 0]))


class Folder(unittest.TestCase):
    def test_a_simulated_folder_becomes_pictures_with_truth(self):
        with tempfile.TemporaryDirectory() as name:
            folder, mav0 = Path(name), Path(name) / "mav0"
            (mav0 / "cam0" / "data").mkdir(parents=True)
            (mav0 / "state_groundtruth_estimate0").mkdir()
            Image.new("RGB", (640, 480), (9, 8, 7)).save(mav0 / "cam0" / "data" / "1000.png")
            (mav0 / "cam0" / "data.csv").write_text("#timestamp [ns],filename\n1000,1000.png\n")
            (mav0 / "cam0" / "sensor.yaml").write_text(
                "T_BS:\n  cols: 4\n  rows: 4\n  data: [0, 0, 1, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 1]\n"
                "intrinsics: [200, 200, 320, 240]\ndistortion_coefficients: [0, 0, 0, 0]\n")
            (mav0 / "state_groundtruth_estimate0" / "data.csv").write_text(
                "#t\n1000,0,0,1,1,0,0,0,0,0,0,0,0,0,0,0,0\n")
            (folder / "objects_truth.json").write_text(json.dumps({"objects": [
                {"id": 3, "class": "toy", "looks_like": "car", "moves": False, "size": [4, 2, 1],
                 "keys": [{"time_ns": 0, "centre": [6, 0, 0], "yaw": 0.0}]}]}))
            (folder / "visibility_truth.csv").write_text(
                "frame,object_id,visible_fraction,x1,y1,x2,y2\n0,3,1.0,100,60,200,160\n")
            images, frames = simulated.read_folder(folder)
        self.assertEqual(images.shape, (1, 240, 320, 3))
        self.assertEqual(images[0, 0, 0].tolist(), [9, 8, 7])
        self.assertEqual(frames[0]["boxes"], [[50.0, 30.0, 100.0, 80.0]])
        self.assertEqual(frames[0]["classes"], [0])
        self.assertAlmostEqual(frames[0]["azimuths"][0], -math.pi / 2, places=3)
        # Seen from 1 m up. The front face is 4 m away, 2 m wide, and 0.5 to 1.5 m below the camera.
        # The roof's far edge is 8 m away and is the highest in the image.
        for found, true in zip(frames[0]["hulls"][0], [135, 126.25, 185, 157.5]):
            self.assertAlmostEqual(found, true, places=2)


class Statistics(unittest.TestCase):
    def test_each_stride_has_its_own(self):
        from perdure_train.network import Trunk
        torch.manual_seed(3)
        trunk = Trunk(8).train()
        for _ in range(250):
            for level, scale in enumerate((1.0, 3.0, 9.0)):
                trunk(torch.randn(4, 8, 12, 12) * scale, level)
        trunk.eval()
        means = [trunk(torch.randn(4, 8, 12, 12) * s, i).mean() for i, s in enumerate((1.0, 3.0, 9.0))]
        for mean in means[1:]:
            self.assertLess(abs(float(mean / means[0]) - 1), 0.15)

    def test_the_exported_network_says_what_the_trained_one_says(self):
        from perdure_train.export import folded
        from perdure_train.network import Network
        torch.manual_seed(5)
        network = Network()
        for _ in range(3):
            network(torch.rand(2, 3, 240, 320) - 0.5)
        network.eval()
        picture = torch.rand(1, 3, 240, 320) - 0.5
        with torch.no_grad():
            for mine, theirs in zip(network(picture), folded(network)(picture)):
                for a, b in zip(mine, theirs):
                    self.assertLess(float((a - b).abs().max()), 1e-3)


if __name__ == "__main__":
    unittest.main()
