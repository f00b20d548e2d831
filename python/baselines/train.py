"""Trains the planner of policy.py by proximal policy optimisation on the toy, and writes toy.npz.

    pip install -r requirements.txt
    python train.py
"""

import sys
import time

import gymnasium
import numpy as np
import palpate.gym
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from policy import FILE, PLACES, features

# heuristic: hyperparameters set by hand. The experiment's trials begin with 3 touches and have seed 2016.
SEED, ENVS, INITIAL, TOUCHES, STEPS = 1, 64, 3, 30, 800_000


class Explorations(VecEnv):
    """Palpate's environments for Stable-Baselines3."""

    def __init__(self):
        self.envs = gymnasium.make_vec(
            "Palpate/Touch-v0", num_envs=ENVS, scene="toy", touches=TOUCHES, initial_touches=INITIAL,
            actions=PLACES, grid=PLACES, reward="error", threads=1,
        )
        seen = spaces.Box(-np.inf, np.inf, (2, PLACES), np.float32)
        super().__init__(ENVS, seen, self.envs.single_action_space)
        self.begun, self.log_rmse = time.time(), []

    def reset(self):
        return self.seen(self.envs.reset(seed=SEED)[0])

    def step_async(self, actions):
        self.actions = actions

    def step_wait(self):
        seen, reward, over, _, info = self.envs.step(self.actions)
        infos = [{} for _ in range(ENVS)]
        if over.any():
            # All episodes have the same length; the next step restarts them.
            assert over.all(), info
            self.log_rmse.append(np.log(info["rmse_m"]).mean())
            said = f"{len(self.log_rmse) * ENVS} episodes, {time.time() - self.begun:.0f} s: "
            print(said + f"log RMSE {self.log_rmse[-1]:.2f}", file=sys.stderr)
            for told, last in zip(infos, self.seen(seen)):
                told["terminal_observation"] = last
            seen = self.envs.step(self.actions)[0]
        return self.seen(seen), reward.astype(np.float32), over, infos

    def seen(self, told):
        return features(told["belief"][:, 0], told["belief"][:, 1])

    def close(self):
        self.envs.close()

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False] * ENVS

    def get_attr(self, attr_name, indices=None):
        return [None] * ENVS

    def set_attr(self, attr_name, value, indices=None): ...

    def env_method(self, method_name, *args, indices=None, **kwargs): ...


class Heads(nn.Module):
    """Scores of places for the actor, and a summary over all places for the critic."""

    latent_dim_pi, latent_dim_vf = PLACES, 64

    def __init__(self):
        super().__init__()
        self.actor = nn.Sequential(
            nn.Conv1d(2, 16, 9, padding=4), nn.ReLU(), nn.Conv1d(16, 16, 9, padding=4), nn.ReLU(),
            nn.Conv1d(16, 1, 1),
        )
        self.critic = nn.Sequential(nn.Linear(2 * PLACES, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh())

    def forward(self, seen):
        return self.forward_actor(seen), self.forward_critic(seen)

    def forward_actor(self, seen):
        return self.actor(seen.reshape(-1, 2, PLACES)).flatten(1)

    def forward_critic(self, seen):
        return self.critic(seen)


class Policy(ActorCriticPolicy):
    """Policy that draws actions from the scores directly."""

    def _build_mlp_extractor(self):
        self.mlp_extractor = Heads()

    def _build(self, lr_schedule):
        super()._build(lr_schedule)
        self.action_net = nn.Identity()


torch.set_num_threads(1)
model = PPO(
    Policy, Explorations(), seed=SEED, device="cpu", n_steps=TOUCHES - INITIAL, batch_size=432, n_epochs=4,
    learning_rate=lambda left: 1e-3 * left, gamma=0.95, gae_lambda=0.9, ent_coef=0.003,
)
model.learn(STEPS)
layers = [layer for layer in model.policy.mlp_extractor.actor if isinstance(layer, nn.Conv1d)]
weights = {f"weight{i}": layer.weight.detach().numpy() for i, layer in enumerate(layers)}
biases = {f"bias{i}": layer.bias.detach().numpy() for i, layer in enumerate(layers)}
np.savez(FILE, **weights, **biases)
