from .instruction import (
    FloorChange as FloorChange,
    Instruction as Instruction,
    Landmark as Landmark,
    Passed as Passed,
    Space as Space,
    Doorway as Doorway,
    Turn as Turn,
)
from .language import Language as Language
from .write import check_language as check_language, languages as languages, sentences as sentences

__all__: list[str]
