"""The paper reproduced, and its question asked on a table that cannot pull."""
