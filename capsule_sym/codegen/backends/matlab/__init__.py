"""MATLAB: constants, closed-form flow and fields as functions of its own language."""

from typing import ClassVar

from sympy.printing.octave import OctaveCodePrinter

from capsule_sym._symbolic.model import declaration, jacobian
from capsule_sym._symbolic.model.model import SEGMENTS, Segment
from capsule_sym._symbolic.model.symbols import MODEL, PULSED, stop
from capsule_sym.codegen._backend import Backend, wrapped
from capsule_sym.codegen._blocks import segment_constants
from capsule_sym.codegen._derived import PARAMETER_NAMES, entries, matrices
from capsule_sym.codegen._lower import Kernel


class Matlab(Backend):
    """Functions of structs, one a file with those that it calls."""

    # Element by element: where no choice is made, constants and durations may be arrays.
    printer = OctaveCodePrinter({"user_functions": {"expm1": "expm1"}})
    comment = "%"
    unpack = "{0} = c.{0};"
    assign = "{} = {};"
    omitted = ("jet", "jet_magnitudes")
    files: ClassVar = {
        f"m/capsule_{name}.m": f"{name}.m.in"
        for name in ("parameters", "constants", "start", "flow", "field")
    }

    def function(self, kernel: Kernel) -> str:
        """Kernel as a function."""
        given, returned = ", ".join(("c", *kernel.arguments)), f"[{', '.join(kernel.returns)}]"
        # All at once: a result may have an argument's name.
        results = ", ".join(map(self.expression, kernel.results))
        return (
            f"function {returned} = {kernel.name}({given})\n% {kernel.doc} {kernel.cost}.\n"
            f"{self.body(kernel)}    {returned} = deal({results});\nend\n"
        )

    def laid_out(self, text: str) -> str:
        """Text with long lines continued."""
        return wrapped(text, " ...", self.comment)

    def texts(self) -> dict[str, str]:
        """Constants, matrices and functions."""
        margin = next(k for k in self.derived.formulas if k.name == "margin_at")
        return {
            **super().texts(),
            "own_stop": str(stop),
            "field_count": str(len(SEGMENTS)),
            "column_count": str(len(jacobian.COLUMNS)),
            "scene": declaration.path().stem,
            "parameter_table": "\n".join(
                f"%      {one.name:10} {one.label}, from {one.low:.9g} to {one.high:.9g}"
                for one in MODEL.parameters
            ),
            "defaults": ", ...\n".join(
                f"    '{one.name}', {float(one.default)!r}" for one in MODEL.parameters
            ),
            "p_parameters": ", ".join(f"p.{name}" for name in PARAMETER_NAMES),
            "segment_constants": "".join(map(self._constants, SEGMENTS)),
            "fields": "".join(map(self._field, SEGMENTS)),
            "margin": self.function(margin),
            "kernels": self.kernels(),
        }

    def _constants(self, segment: Segment) -> str:
        """Assignments of a field's constants, in a switch by its number."""
        text = f"    case {segment.index} % {segment.mode}\n"
        modes = {"high": 1 - segment.level} if PULSED else {}
        modes |= {"contact": segment.contact, "drift": segment.drift}
        text += f"        {' '.join(f'c.{name} = {value};' for name, value in modes.items())}\n"
        for name, value in segment_constants(segment.index):
            text += f"        c.{name} = {self.expression(value)};\n"
        return text

    def _field(self, segment: Segment) -> str:
        """Assignments of its matrices A and G."""
        rates, guards = matrices(segment).values()
        size = len(rates) + 1
        text = f"    case {segment.index} % {segment.mode}\n"
        text += f"        A = zeros({size}); G = zeros({len(guards)}, {size});\n"
        for name, matrix in (("A", rates), ("G", guards)):
            for i, j, value in entries(matrix):
                text += f"        {name}({i + 1}, {j + 1}) = {self.expression(value)};\n"
        return text
