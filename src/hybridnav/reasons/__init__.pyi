from .proofs import prove as prove
from .why import Explanation as Explanation, explain as explain, reasons_of as reasons_of
from .why_words import BlockedEnd as BlockedEnd, Closure as Closure, TightPlace as TightPlace

__all__: list[str]
