# The public names as type checkers read them; rodfem/__init__.py loads each from the same module when it is used.

__version__: str

from rodfem.branch import Branch as Branch
from rodfem.branch import Point as Point
from rodfem.branch import Special as Special
from rodfem.continuation import Steps as Steps
from rodfem.diagram import Diagram as Diagram
from rodfem.ends import Attachment as Attachment
from rodfem.ends import Constraint as Constraint
from rodfem.ends import End as End
from rodfem.ends import Ring as Ring
from rodfem.ends import at as at
from rodfem.ends import clamped as clamped
from rodfem.ends import elastic as elastic
from rodfem.ends import everywhere as everywhere
from rodfem.ends import free as free
from rodfem.ends import hinged as hinged
from rodfem.ends import integral as integral
from rodfem.ends import pinned as pinned
from rodfem.ends import sliding as sliding
from rodfem.errors import ConvergenceError as ConvergenceError
from rodfem.errors import SceneError as SceneError
from rodfem.fields import Discretization as Discretization
from rodfem.files import load_json as load_json
from rodfem.loci.locus import Locus as Locus
from rodfem.modes import Modes as Modes
from rodfem.modes import load_modes as load_modes
from rodfem.observer import Observer as Observer
from rodfem.plan import Plan as Plan
from rodfem.runner import run as run
from rodfem.saved import load as load
from rodfem.scene import Inertia as Inertia
from rodfem.scene import Ordinate as Ordinate
from rodfem.scene import Parameter as Parameter
from rodfem.scene import Scene as Scene
from rodfem.sharing import many as many
from rodfem.solvers import Solver as Solver
from rodfem.tracing import trace as trace
