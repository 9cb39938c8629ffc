"""Leave doctests of modules alone whose optional package is not installed."""

from importlib.util import find_spec

NEEDS = {
    "src/bingham/torch/*": "torch",
    "src/bingham/torch/on_cuda.py": "triton",
    "src/bingham/jax/*": "jax",
    "src/bingham/jax/distribution.py": "numpyro",
}
collect_ignore_glob = [path for path, package in NEEDS.items() if find_spec(package) is None]
