from .links import Link as Link, LinkEnd as LinkEnd, LinkKind as LinkKind

__all__: list[str]
