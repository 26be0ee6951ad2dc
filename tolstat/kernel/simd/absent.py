"""Code for parts that a mechanism does not have is left out of its kernels before Numba infers types.

The kernels are written for any mechanism, and the type of a record says which numbers and shapes its mechanism has. So
some conditions have one outcome, ``par.hinge_axis[hinge] == GENERAL`` where no hinge is general, and some loops have no
iteration. LLVM removes their code, too, but only after types were inferred and the code was lowered, which take most of
the time of a compilation.

This module depends on Numba's internals, as `unit` does; ``tests/kernel/test_compilation.py`` fails where they change.
"""

import operator
from itertools import product

from numba.core import ir, types
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import get_definition, guard

from tolstat.common.parameters import numbers_of

COMPARISONS = (operator.eq, operator.ne, operator.lt, operator.le, operator.gt, operator.ge)
EVALUATED = (*COMPARISONS, operator.add, operator.sub, operator.mul)


@register_pass(mutates_CFG=True, analysis_only=False)
class DecideConditions(FunctionPass):
    """Compiler pass: write the outcomes that a mechanism decides, for Numba's branch pruning, which follows."""

    _name = "decide_conditions"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        """Replace comparisons with one outcome by it, and branches into loops without an iteration by jumps."""
        code = Code(state.func_ir, state.args)
        for block in state.func_ir.blocks.values():
            for statement in block.find_insts(ir.Assign):
                code.decide(statement)
            if code.is_empty_loop(block.terminator):
                block.body[-1] = ir.Jump(block.terminator.falsebr, block.terminator.loc)
        return True


class Code:
    """Intermediate code of a function whose arguments have the types `arguments`."""

    def __init__(self, code, arguments):
        self.code = code
        self.arguments = arguments

    def definition(self, variable):
        """Definition of a variable; None if it has several."""
        return guard(get_definition, self.code, variable)

    def decide(self, statement):
        """Replace a comparison by its outcome if there is only one."""
        comparison = statement.value
        if not _is(comparison, "binop") or comparison.fn not in COMPARISONS:
            return
        outcomes = self.values(comparison)
        if len(outcomes) == 1:
            statement.value = ir.Const(outcomes.pop(), statement.loc)
            definitions = self.code._definitions[statement.target.name]
            definitions[definitions.index(comparison)] = statement.value

    def is_empty_loop(self, end):
        """Whether the end of a block is the head of a loop over a range without a number."""
        source = self.definition(end.cond) if isinstance(end, ir.Branch) else None
        for op in ("pair_second", "iternext", "getiter"):
            source = self.definition(source.value) if _is(source, op) else None
        if not _is(source, "call") or getattr(self.definition(source.func), "value", None) is not range:
            return False
        bounds = [self.values(self.definition(argument)) for argument in source.args]
        return all(len(values) == 1 for values in bounds) and not range(*(min(values) for values in bounds))

    def values(self, definition):
        """All integers that may result from a definition; empty if the types of the arguments do not tell."""
        if isinstance(definition, ir.Const | ir.Global | ir.FreeVar):
            return {definition.value} if isinstance(definition.value, int) else set()
        if _is(definition, "binop") and definition.fn in EVALUATED:
            left, right = (self.values(self.definition(side)) for side in (definition.lhs, definition.rhs))
            return {definition.fn(a, b) for a, b in product(left, right)}
        if _is(definition, "getattr"):
            return self.field(definition)[1]
        if _is(definition, "getitem"):
            array = self.definition(definition.value)
            if _is(array, "getattr") and array.attr == "shape":
                shape, index = self.field(self.definition(array.value))[0], self.definition(definition.index)
                return {shape[axis] for axis in self.values(index)} if shape else set()
            return self.field(array)[1]
        return set()

    def field(self, definition):
        """Shape of a field of an argument, and its elements if they are numbers of the mechanism; both empty if not."""
        argument = self.definition(definition.value) if _is(definition, "getattr") else None
        record = self.arguments[argument.index] if isinstance(argument, ir.Arg) else None
        if not isinstance(record, types.Record):
            return (), set()
        numbers = numbers_of(record)
        if definition.attr in numbers:
            array = numbers[definition.attr]
            return array.shape, set(array.ravel().tolist())
        field = record.fields.get(definition.attr)  # None: an error that Numba reports
        return getattr(field and field.type, "shape", ()), set()


def _is(definition, op):
    """Whether a definition is an expression of a kind."""
    return isinstance(definition, ir.Expr) and definition.op == op
