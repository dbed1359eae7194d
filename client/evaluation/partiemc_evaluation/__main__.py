"""The command: python3 -m partiemc_evaluation paper|set|surfaces|matter ..."""

import argparse
import hashlib
import os
import pathlib
import sys
from typing import Callable, Sequence as Seq

import partiemc

from .matter import matter_tables, run_matter
from .matter_scenes import SETS as MATTER_SETS, make_matter_set
from .paper import default_film, judge_claims, run_paper
from .recordings import read_recording
from .report import Evaluation, as_html, as_json, as_text, matter_html, matter_json
from .scenes import SETS, digest, make_scene, make_set
from .shapes import TUNING_SHAPES, VALIDATION_SHAPES
from .study import PLACEMENTS, Method, all_methods, run_study
from .surfaces import run_surfaces, surface_digest, surface_sets, surface_tables

_ABOUT = """Measures the placements of PartiEMC on sequences whose true outline is known, and on recordings. Needs
PYTHONPATH=BUILD/python:client/evaluation, where BUILD has the package partiemc."""
_EXAMPLES = """examples:
  python3 -m partiemc_evaluation set smoke                             # a few seconds: does it work?
  python3 -m partiemc_evaluation set tuning --steps --output-dir out   # what is each step worth?
  python3 -m partiemc_evaluation set none --recordings tests/data/recordings
  python3 -m partiemc_evaluation paper --set smoke --output-dir out \\
      --recording client/recordings/dam_break.pemc                     # then open out/evaluation.html

Choose methods and constants by `tuning`. `validation` has other shapes, bodies and seeds; it is read once, when a
method is final, and nothing is chosen by it."""


def _range(text: str) -> slice:
    first, _, last = text.partition(":")
    return slice(int(first or 0), int(last) if last else None)


def _count(text: str) -> int:
    if int(text) < 1:
        raise ValueError(text)
    return int(text)


def _parser() -> argparse.ArgumentParser:
    shared = argparse.ArgumentParser(add_help=False)
    add = shared.add_argument
    add("--recording", metavar="FILE", type=pathlib.Path, action="append", default=[],
        help="a .pemc file to measure, too; the first is the film of the paper's figures")
    add("--recordings", metavar="DIR", type=pathlib.Path, help="all .pemc files of a folder, too")
    add("--frames", metavar="A:B", type=_range, default=slice(None), help="frames A to B - 1 of each recording, from 0")
    add("--methods", metavar="NAMES", default="", help="methods beside the four placements, separated by commas; "
        "'placements' for none of them; all by default")
    add("--steps", action="store_true", help="also the default without each of its steps")
    add("--sensitivity", action="store_true", help="also the default with each of its constants times 0.7 and 1.4")
    add("--volumes", action="store_true", help="give methods the volume of each particle")
    add("--output-dir", metavar="DIR", type=pathlib.Path, help="write evaluation.html and evaluation.json here")
    add("--jobs", metavar="N", type=_count, default=os.cpu_count() or 1,
        help="sequences at a time; one for each processor by default")
    add("--quiet", action="store_true", help="no progress")
    parser = argparse.ArgumentParser("partiemc_evaluation", description=_ABOUT, epilog=_EXAMPLES,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="set|paper|surfaces|matter")
    one = verbs.add_parser("set", parents=[shared], help="measure every method on a set of synthetic sequences: ratios "
                           "to marching squares in accuracy, area and jitter, by group and by sampler, with intervals")
    one.add_argument("set", choices=(*SETS, "none"), help="the set; 'none' for recordings alone")
    one.add_argument("--digests", action="store_true", help="print a digest of the particles of each sequence and of all "
                     "(committed: client/evaluation/digests.txt), and measure nothing")
    paper = verbs.add_parser("paper", parents=[shared], help="the same, then the paper's Tables 1 to 4 and Figures 5 to "
                             "14 from our own scenes, and a verdict on each of its 27 claims")
    paper.add_argument("--set", choices=SETS, default="tuning", help="set of Tables 3 and 4; tuning by default")
    space = verbs.add_parser("surfaces", help="measure the placements of surfaces in space on a set of scenes with known "
                             "truth; each surface is checked (S1 to S5 of core/SURFACES.md)")
    space.add_argument("set", choices=surface_sets())
    space.add_argument("--digests", action="store_true", help="print a digest of the particles of each scene, and measure "
                       "nothing")
    matter = verbs.add_parser("matter", help="measure sizes, grains, phases, walls and periodic boxes with the feature "
                              "and without it")
    matter.add_argument("set", choices=MATTER_SETS, nargs="?", default="all", help="all groups (the default), one of "
                        "them, or one scene of each kind (smoke)")
    matter.add_argument("--output-dir", metavar="DIR", type=pathlib.Path, help="write matter.html and matter.json here")
    for scenes in (space, matter):
        scenes.add_argument("--jobs", metavar="N", type=_count, default=os.cpu_count() or 1, help="scenes at a time; "
                            "one for each processor by default")
        scenes.add_argument("--quiet", action="store_true", help="no progress")
    return parser


def _methods(options: argparse.Namespace) -> list[Method]:
    methods = all_methods(options.steps, options.sensitivity)
    wanted = {*options.methods.split(","), *PLACEMENTS} - {"", "placements"}
    unknown = wanted - {method.name for method in methods}
    if unknown:
        raise ValueError(f"--methods: {min(unknown)}; must be some of {', '.join(m.name for m in methods)}")
    return [method for method in methods if not options.methods or method.name in wanted]


def _print_digests(name: str) -> None:
    total = hashlib.sha256()
    for recipe in make_set(name):
        line = f"{digest(make_scene(recipe))}  {name}/{recipe.name}"
        total.update(f"{line}\n".encode())
        print(line, flush=True)
    print(f"{total.hexdigest()[:16]}  all of {name}")


def _run(options: argparse.Namespace) -> None:
    def progress(text: str) -> None:
        if not options.quiet:
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
    notes: list[str] = []
    in_folder = sorted(options.recordings.glob("*.pemc")) if options.recordings else []
    if options.recordings and not in_folder:
        raise ValueError(f"--recordings: {options.recordings} has no .pemc file")
    paths = options.recording + in_folder
    recordings = [read_recording(path, notes, options.frames) for path in paths]
    sources = [*([] if options.set == "none" else make_set(options.set)), *recordings]
    if not sources:
        raise ValueError("nothing to measure: 'none' needs --recording or --recordings with .pemc files")
    if options.output_dir:
        options.output_dir.mkdir(parents=True, exist_ok=True)
    given = ["volumes" if options.volumes else "spacing", "nothing"]
    study = run_study(sources, _methods(options), given, options.jobs,
                      lambda done: progress(f"{done} of {len(sources)} sequences"))
    title = f"Evaluation: {', '.join([options.set, *(recording.name for recording in recordings)])}"
    evaluation = Evaluation(title, study, notes=notes)
    if options.verb == "paper":
        evaluation.runs = run_paper(recordings[0] if recordings else default_film(), progress,
                                    VALIDATION_SHAPES if options.set == "validation" else TUNING_SHAPES)
        evaluation.claims = judge_claims(study, evaluation.runs)
    progress("")
    print(as_text(evaluation))
    if options.output_dir:
        (options.output_dir / "evaluation.html").write_text(as_html(evaluation))
        (options.output_dir / "evaluation.json").write_text(as_json(evaluation))


def _progress(options: argparse.Namespace, count: int) -> Callable[[int], None]:
    def progress(done: int) -> None:
        if not options.quiet:
            print(f"\r\x1b[K{done} of {count} scenes", end="\n" if done == count else "", file=sys.stderr, flush=True)
    return progress


def _run_surfaces(options: argparse.Namespace) -> None:
    recipes = surface_sets()[options.set]
    if options.digests:
        for recipe in recipes:
            print(f"{surface_digest(recipe)}  {options.set}/{recipe.name}", flush=True)
        return

    for table in surface_tables(run_surfaces(recipes, options.jobs, _progress(options, len(recipes)))):
        print(table.as_text())


def _run_matter(options: argparse.Namespace) -> None:
    recipes = make_matter_set(options.set)
    if options.output_dir:
        options.output_dir.mkdir(parents=True, exist_ok=True)
    found = run_matter(recipes, options.jobs, _progress(options, len(recipes)))
    for table in matter_tables(found.rows):
        print(table.as_text())
    if options.output_dir:
        (options.output_dir / "matter.html").write_text(matter_html(found))
        (options.output_dir / "matter.json").write_text(matter_json(found))


def main(arguments: Seq[str] | None = None) -> int:
    """Runs the command. Returns 0, or 1 if an input cannot be read or measured. A wrong flag exits
    with code 2."""
    options = _parser().parse_args(arguments)
    try:
        if options.verb == "surfaces":
            _run_surfaces(options)
        elif options.verb == "matter":
            _run_matter(options)
        elif options.verb == "set" and options.digests:
            _print_digests(options.set)
        else:
            _run(options)
    except (ValueError, OSError, partiemc.Error) as error:
        print(f"partiemc_evaluation: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
