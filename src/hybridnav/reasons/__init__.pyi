from .proofs import prove as prove
from .why import Explanation as Explanation, explain as explain
from .why_words import BlockedEnd as BlockedEnd, Closure as Closure, TightPlace as TightPlace

__all__: list[str]
