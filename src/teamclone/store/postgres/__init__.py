"""The store in a PostgreSQL database. It needs the extra ``postgresql``."""
