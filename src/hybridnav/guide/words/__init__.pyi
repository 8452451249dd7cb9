from .instruction import (
    Doorway as Doorway,
    FloorChange as FloorChange,
    Instruction as Instruction,
    Landmark as Landmark,
    Space as Space,
    Turn as Turn,
    Wall as Wall,
)
from .language import Language as Language
from .write import (
    check_language as check_language,
    languages as languages,
    sentences as sentences,
    words as words,
)

__all__: list[str]
