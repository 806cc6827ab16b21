"""The neutral suite of hard events; the folder stands alone and can be copied."""
