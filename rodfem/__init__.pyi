# The public names as type checkers read them; rodfem/__init__.py loads each from the same module when it is used.

__version__: str

from rodfem.app.many import many as many
from rodfem.app.run import run as run
from rodfem.codim2.locus import Locus as Locus
from rodfem.continuation.branch import Branch as Branch
from rodfem.continuation.branch import Point as Point
from rodfem.continuation.branch import SpecialPoint as SpecialPoint
from rodfem.continuation.follow import IndexStepControl as IndexStepControl
from rodfem.continuation.follow import StepControl as StepControl
from rodfem.continuation.observer import Observer as Observer
from rodfem.diagram.diagram import Diagram as Diagram
from rodfem.diagram.diagram import trace as trace
from rodfem.diagram.plan import Plan as Plan
from rodfem.diagram.saved import load as load
from rodfem.diagram.solver import Solver as Solver
from rodfem.errors import ConvergenceError as ConvergenceError
from rodfem.errors import InputError as InputError
from rodfem.errors import SceneError as SceneError
from rodfem.errors import SetupError as SetupError
from rodfem.fem.fields import Discretization as Discretization
from rodfem.modes.modes import Modes as Modes
from rodfem.modes.modes import load_modes as load_modes
from rodfem.output.files import load_json as load_json
from rodfem.problem import section as section
from rodfem.problem.contribution import Attachment as Attachment
from rodfem.problem.contribution import Constraint as Constraint
from rodfem.problem.contribution import at as at
from rodfem.problem.contribution import everywhere as everywhere
from rodfem.problem.contribution import integral as integral
from rodfem.problem.ends import End as End
from rodfem.problem.ends import Ring as Ring
from rodfem.problem.ends import clamped as clamped
from rodfem.problem.ends import elastic as elastic
from rodfem.problem.ends import free as free
from rodfem.problem.ends import hinged as hinged
from rodfem.problem.ends import pinned as pinned
from rodfem.problem.ends import sliding as sliding
from rodfem.problem.ends import sliding_hinge as sliding_hinge
from rodfem.problem.events import Event as Event
from rodfem.problem.scene import Inertia as Inertia
from rodfem.problem.scene import Ordinate as Ordinate
from rodfem.problem.scene import Parameter as Parameter
from rodfem.problem.scene import Scene as Scene
from rodfem.problem.table import path as path
from rodfem.problem.table import tabulated as tabulated
