"""Tests in processes that a parent with running threads starts: nothing waits for threads that a fork left behind."""

import multiprocessing

import gymnasium
import numpy as np
import own
import palpate
import palpate.gym
import pytest

#: Time after which a process counts as hanging, seconds; it needs a few.
LIMIT_S = 60.0

CONTEXTS = ["fork", "forkserver", "spawn"]


@pytest.fixture(autouse=True)
def threads_of_the_parent():
    """Starts the parent's threads: those of an environment, of a run, and of ground truths."""
    envs = palpate.gym.TouchVectorEnv(2, "bird", touches=6, grid=4, threads=2)
    envs.reset(seed=0)
    palpate.Experiment.load("bird", touches=6, initial_touches=4, grid=5).run(["random"], 1).summary()
    return envs


@pytest.mark.parametrize("context", CONTEXTS)
def test_asynchronous_environments_step(context):
    settings = {"scene": "bird", "touches": 8, "grid": 4}
    envs = gymnasium.make_vec(
        "Palpate/Touch-v0", 2, vectorization_mode="async", vector_kwargs={"context": context}, **settings
    )
    try:
        envs.reset_async(seed=[3, 4])
        seen, _ = envs.reset_wait(timeout=LIMIT_S)
        actions = np.full((2, 2), 0.25, dtype=np.float32)
        envs.step_async(actions)
        _, reward, *_ = envs.step_wait(timeout=LIMIT_S)
    except BaseException:
        envs.close(terminate=True)
        raise
    envs.close()
    alone = palpate.gym.TouchEnv(**settings)
    assert (seen["touches"][1] == alone.reset(seed=4)[0]["touches"]).all()
    assert reward[1] == alone.step(actions[1])[1]


def explore(answers, envs):
    """Uses everything that computes in parallel."""
    run = palpate.Experiment.load("bird", touches=6, initial_touches=4, grid=5).run([own.Middle, "random"], 2, threads=2)
    scene = palpate.Scene.load("bird_around")
    exploration = palpate.Exploration(scene)
    touch = exploration.touch(scene.ball.aim([0, 1, 0]))
    reward = None if envs is None else envs.reset(seed=0)[0]["count"].tolist()
    belief = exploration.belief
    counts = len(belief.mesh()[0]), len(belief.field(touch.p_wc[None])[0])
    answers.put((run.rows(), str(run), touch.outcome, exploration.metrics is not None, counts, reward))


@pytest.mark.parametrize("context", CONTEXTS)
def test_runs_and_explorations_work_in_a_child(context, threads_of_the_parent):
    forks = multiprocessing.get_context(context)
    answers = forks.Queue()
    # Only a fork can use the parent's environments.
    envs = threads_of_the_parent if context == "fork" else None
    child = forks.Process(target=explore, args=(answers, envs))
    child.start()
    try:
        rows, text, outcome, has_metrics, (vertices, places), count = answers.get(timeout=LIMIT_S)
    finally:
        child.kill()
        child.join()
    run = palpate.Experiment.load("bird", touches=6, initial_touches=4, grid=5).run([own.Middle, "random"], 2)
    assert (rows, text) == (run.rows(), str(run))
    assert outcome == "contact" and has_metrics and vertices > 100 and places == 1
    assert count == ([5, 5] if context == "fork" else None)
