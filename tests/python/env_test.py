# SPDX-License-Identifier: Apache-2.0
"""hapsix.env: assembly tasks with Gymnasium's interface, one at a time and in crowds."""
import subprocess
import sys
import unittest

from parts import SCENE  # noqa: F401: first, since it ends the test where NumPy is missing
import hapsix.env
import numpy as np


class Environments(unittest.TestCase):
    @staticmethod
    def policy(observation, way=0.15):
        """Over the hole and upright first, then down."""
        action = np.zeros(6)
        action[:2] = observation[:2] / 0.5
        action[3:] = -2 * observation[4:7] / np.radians(0.5)
        if np.abs(observation[:2]).max() < way and np.linalg.norm(observation[4:7]) < 3e-3:
            action[2] = -1
        return np.clip(action, -1, 1)

    def play(self, env, seed):
        observation, _ = env.reset(seed=seed)
        total = 0
        for _ in range(env._many.task.actions):
            observation, reward, terminated, truncated, info = env.step(self.policy(observation))
            total += reward
            if terminated or truncated:
                break
        return observation, total, terminated, info

    def test_a_peg_that_is_led_over_its_hole_goes_in(self):
        env = hapsix.env.AssemblyEnv()
        for seed in (1, 2, 3):
            observation, total, terminated, info = self.play(env, seed)
            self.assertTrue(terminated)
            self.assertGreater(total, 30)
            self.assertLess(info["max_depth"], 0.5e-3)
        self.assertTrue(env.observation_space.contains(observation))
        self.assertTrue(env.action_space.contains(env.action_space.sample()))

    def test_a_peg_beside_its_hole_stands_on_the_block(self):
        env = hapsix.env.AssemblyEnv()
        env.reset(seed=1)
        env.step([1, 0, 0, 0, 0, 0])
        for k in range(150):
            action = [1, 0, 0, 0, 0, 0] if k < 20 else [0, 0, -1, 0, 0, 0]
            observation, _, terminated, _, info = env.step(action)
        self.assertFalse(terminated)
        self.assertLess(observation[2], -29.5)  # its end is at the top of the block still
        self.assertGreater(info["contacts"], 0)
        self.assertGreater(info["force"], 1)

    def test_the_same_seed_and_actions_give_the_same_bits_also_in_a_crowd(self):
        env = hapsix.env.AssemblyEnv()
        a, b = self.play(env, 7), self.play(env, 7)
        np.testing.assert_array_equal(a[0], b[0])
        hashes = []
        for threads in (1, 2):
            many = hapsix.env.AssemblyVectorEnv(6, threads=threads)
            many.reset(seed=5)
            random = np.random.default_rng(2)
            for _ in range(30):
                observations, rewards, *_ = many.step(random.uniform(-1, 1, (6, 6)))
            hashes.append(many.batch.state_hash.copy())
        np.testing.assert_array_equal(*hashes)
        self.assertEqual((observations.shape, rewards.shape), ((6, 22), (6,)))

    @staticmethod
    def screw(observation):
        """Presses down and turns: the thread, or the teeth, let the part down."""
        action = np.zeros(6)
        action[:2] = observation[:2] / 0.5
        action[2] = -1
        action[3:5] = -2 * observation[4:6] * np.sign(observation[3]) / np.radians(0.5)
        action[5] = -1
        return np.clip(action, -1, 1)

    def test_a_nut_goes_down_its_bolt_as_it_is_turned_and_not_as_it_is_pushed(self):
        env = hapsix.env.AssemblyEnv("nut-on-bolt")
        observation, _ = env.reset(seed=3)
        for _ in range(120):
            observation, _, terminated, _, info = env.step([0, 0, -1, 0, 0, 0])
        self.assertFalse(terminated)
        self.assertLess(observation[2], -2)  # it stands on the thread
        self.assertGreater(info["contacts"], 0)
        # The way onto the thread is chaotic: of 60 seeds 42 go down.
        down = 0
        for seed in range(1, 7):
            observation, total, turned = env.reset(seed=seed)[0], 0, 0
            for _ in range(env._many.task.actions):
                observation, reward, terminated, truncated, info = env.step(self.screw(observation))
                total, turned = total + reward, turned + np.degrees(env._many.task.turn)
                if terminated or truncated:
                    break
            down += terminated
            if terminated:
                self.assertGreater(turned, 360)
                self.assertGreater(total, 12)
        self.assertGreaterEqual(down, 2)

    def test_a_shaft_and_a_gear_go_in_as_their_teeth_find_the_gaps(self):
        for task, turn in (("shaft-in-hub", 0.0), ("gear-mesh", 0.0)):
            env = hapsix.env.AssemblyEnv(task)
            upright = env._many._upright
            for seed in (1, 2):
                observation, _ = env.reset(seed=seed)
                for _ in range(env._many.task.actions):
                    off = hapsix.env._times(observation[None, 3:7].astype(float), upright[None] * (1, -1, -1, -1))[0]
                    off *= np.sign(off[0])
                    action = np.zeros(6)
                    action[:2] = observation[:2] / 0.5
                    action[3:] = -2 * off[1:] / np.radians(0.5)
                    if np.abs(observation[:2]).max() < 0.2 and np.linalg.norm(off[1:]) < 4e-3:
                        action[2] = -1
                    observation, _, terminated, truncated, info = env.step(np.clip(action, -1, 1))
                    if terminated or truncated:
                        break
                self.assertTrue(terminated, (task, seed, observation))

    def test_every_task_starts_free_and_ends_by_truncation_when_nothing_is_done(self):
        for name, task in hapsix.env.TASKS.items():
            short = hapsix.env.dataclasses.replace(task, actions=3)
            env = hapsix.env.AssemblyEnv(short)
            first, _ = env.reset(seed=1)
            again, _ = env.reset(seed=1)
            other, _ = env.reset(seed=2)
            np.testing.assert_array_equal(first, again, name)
            self.assertFalse(np.array_equal(first, other), name)
            for k in range(3):
                observation, _, terminated, truncated, info = env.step(np.zeros(6))
                self.assertEqual((terminated, truncated), (False, k == 2), name)
                self.assertTrue(np.isfinite(observation).all())
            self.assertEqual(info["contacts"], 0, name)

    def test_wrong_tasks_and_actions_are_refused_in_a_sentence(self):
        with self.assertRaisesRegex(ValueError, "nut-on-bolt"):
            hapsix.env.AssemblyEnv("screw-driver")
        env = hapsix.env.AssemblyEnv()
        env.reset(seed=1)
        for wrong in (np.zeros(5), np.full(6, np.nan)):
            with self.assertRaises(ValueError):
                env.step(wrong)
        env.step(np.full(6, np.inf))  # as far as an action goes

    def test_an_episode_that_ends_in_a_crowd_begins_anew(self):
        task = hapsix.env.dataclasses.replace(hapsix.env.PEG_IN_HOLE, actions=5)
        many = hapsix.env.AssemblyVectorEnv(3, task)
        many.reset(seed=1)
        for k in range(5):
            observations, _, terminated, truncated, infos = many.step(np.zeros((3, 6)))
            self.assertEqual(truncated.all(), k == 4)
        self.assertEqual(infos["final_obs"].shape, (3, 22))
        self.assertTrue(infos["_final_obs"].all())
        self.assertLess(observations[0, 2], -30)  # above the block again

    def test_an_episode_in_a_crowd_starts_as_it_does_alone(self):
        many = hapsix.env.AssemblyVectorEnv(3, autoreset=False)
        together, _ = many.reset(seed=7)
        listed, _ = many.reset(seed=[7, 8, 9])
        np.testing.assert_array_equal(listed, together)
        for i in range(3):
            alone, _ = hapsix.env.AssemblyEnv().reset(seed=7 + i)
            np.testing.assert_array_equal(alone, together[i])
        many.step(np.ones((3, 6)))
        some, _ = many.reset(options={"reset_mask": np.array([False, True, False])})
        self.assertEqual((some[:, 21] == 0).tolist(), [False, True, False])  # its hand is at the part again
        for wrong in ([1, 0, 1], np.ones(2, bool)):
            with self.assertRaises(ValueError):
                many.reset(options={"reset_mask": np.array(wrong)})
        with self.assertRaises(ValueError):
            many.reset(seed=[1, 2])

    def test_where_gymnasium_is_installed_its_classes_are_the_bases(self):
        # A stand-in with the names of Gymnasium 1.1, which Debian 12 does not have.
        code = """
import sys, types, enum
def module(name, **names):
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(names)
    return sys.modules[name]
class Env:
    def reset(self, *, seed=None, options=None): self.seeded = seed
class VectorEnv: pass
class Box:
    def __init__(self, low, high, shape, dtype): self.shape = shape
Mode = enum.Enum("AutoresetMode", "NEXT_STEP SAME_STEP DISABLED")
spaces, vector = module("gymnasium.spaces", Box=Box), module("gymnasium.vector", VectorEnv=VectorEnv, AutoresetMode=Mode)
module("gymnasium", Env=Env, spaces=spaces, vector=vector)
import hapsix, hapsix.env
one, many = hapsix.env.AssemblyEnv(), hapsix.env.AssemblyVectorEnv(2)
assert isinstance(one, Env) and isinstance(many, VectorEnv)
assert many.metadata["autoreset_mode"] is Mode.SAME_STEP
assert hapsix.env.AssemblyVectorEnv(2, autoreset=False).metadata["autoreset_mode"] is Mode.DISABLED
one.reset(seed=4)
assert one.seeded == 4 and isinstance(many.single_action_space, Box)
many.reset(seed=1), many.step([[0] * 6] * 2), many.close()
"""
        said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        self.assertEqual((said.returncode, said.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
