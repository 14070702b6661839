"""Long work: durable records of what was asked, its progress and its result."""

from app.operations.service import Control, Operations

__all__ = ["Control", "Operations"]
