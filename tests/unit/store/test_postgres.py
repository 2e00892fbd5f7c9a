"""What is particular to the store in a PostgreSQL server: URLs, rights, keys, connections that are lost."""

from __future__ import annotations

import dataclasses
import pickle
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from postgres import DATABASE, ENCODED, OWNER, PASSWORD, Server
from teamclone.errors import StoreError, UsageError
from teamclone.logs import Match
from teamclone.store import create_store, open_store, schema
from teamclone.store.postgres.location import Location, masked
from teamclone.store.postgres.store import PostgresStore
from teamclone.store.store import Added


@pytest.fixture
def url(postgres: Server) -> str:
    return postgres.new_url()


def schema_of(url: str) -> str:
    return Location.parse(url).schema


# -- URLs ------------------------------------------------------------------------------------------------------------


def test_a_url_is_split() -> None:
    location = Location.parse("postgresql://ann:p%40ss@db.example:5433/robocup?schema=world%20cup&sslmode=require")
    assert location.schema == "world cup"
    assert location.uri.startswith("postgresql://ann:p%40ss@db.example:5433/robocup?sslmode=require&connect_timeout=")
    assert "schema" not in location.uri
    assert set(location.passwords) == {"p%40ss", "p@ss"}
    assert location.shown == "postgresql://ann:***@db.example:5433/robocup?schema=world%20cup&sslmode=require"
    plain = Location.parse("postgres://db")
    assert (plain.schema, plain.uri[:15], plain.passwords) == ("teamclone", "postgres://db/?", ())
    assert Location.parse("postgresql:///x?connect_timeout=3").uri.count("connect_timeout") == 1


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        ("postgresql://a:secret@h/d", "postgresql://a:***@h/d"),
        ("postgresql://a:se@c:r/e?t@h/d", "postgresql://a:***@h/d"),
        ("postgresql://a@h/d", "postgresql://a@h/d"),
        ("postgresql:///d?user=a&password=secret&host=/tmp", "postgresql:///d?user=a&password=***&host=/tmp"),
    ],
)
def test_passwords_are_masked(url: str, shown: str) -> None:
    assert masked(url) == shown


@pytest.mark.parametrize("password", ["secr@et", "secr/et", "secr?et", "secr#et", "secr@e/t"])
def test_a_password_that_is_not_encoded_is_explained_but_not_shown(password: str) -> None:
    with pytest.raises(UsageError, match=r"%40 for @") as caught:
        open_store(f"postgresql://ann:{password}@127.0.0.1:1/x")
    assert "secr" not in str(caught.value)


def test_a_location_keeps_its_password_to_itself(url: str) -> None:
    location = create_store(url).location
    task = dataclasses.make_dataclass("Task", ["location"], frozen=True)(location)
    for text in (repr(location), repr(task), repr([location])):
        assert ENCODED not in text
        assert "***" in text
    sent = pickle.loads(pickle.dumps(location))
    assert sent == url
    assert ENCODED not in repr(sent)
    assert open_store(sent).match_ids() == []


@pytest.mark.parametrize("url", ["mysql://h/d", "postgresql+psycopg://h/d"])
def test_other_servers_are_refused(url: str) -> None:
    with pytest.raises(UsageError, match="expected a folder or postgresql://"):
        create_store(url)


# -- servers and stores that are not as they should ------------------------------------------------------------------


def test_a_server_that_cannot_be_used(postgres: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("teamclone.store.postgres.connection.FIRST_PAUSES_S", (0.01,))
    for url, told, remedy in (
        (postgres.url(password="wrong%2Fpw"), "password authentication failed", "check user and password"),
        (postgres.url(user="nobody"), "authentication failed", "check user and password"),
        (postgres.url(database="nothing"), 'database "nothing" does not exist', "createdb"),
        ("postgresql://u:wrong%2Fpw@127.0.0.1:1/x", "Connection refused", "does the server run there"),
        ("postgresql://u:wrong%2Fpw@nohost.invalid/x", "host name", "check the host"),
        ("postgresql:///x?host=/nowhere", "No such file", "does the server run there"),
        ("postgresql://u:wrong%2Fpw@127.0.0.1:port/x", "invalid", "form of the URL"),
        ("postgresql://u@127.0.0.1/x?colour=red", "colour", "form of the URL"),
    ):
        for verb in (create_store, open_store):
            with pytest.raises(StoreError) as caught:
                verb(url)
            text = str(caught.value)
            assert told in text, url
            assert remedy in text, url
            assert "\n" not in text
            for password in ("wrong", PASSWORD, ENCODED):
                assert password not in text


def test_a_schema_without_a_store(postgres: Server, url: str) -> None:
    with pytest.raises(StoreError, match=r"holds no store; make one with `teamclone ingest PATH --store postgresql://"):
        open_store(url)
    name = schema_of(url)
    postgres.sql(f"create schema {name}; create table {name}.theses (title text)", database=DATABASE)
    postgres.sql(f"grant all on schema {name} to {OWNER}", database=DATABASE)
    with pytest.raises(StoreError, match="holds other things"):
        create_store(url)


@pytest.mark.parametrize(("number", "remedy"), [(schema.FORMAT + 1, "update teamclone"), (0, "another schema")])
def test_other_formats_are_refused(postgres: Server, url: str, number: int, remedy: str) -> None:
    create_store(url)
    postgres.sql(f"update {schema_of(url)}.teamclone_store set format = {number}, teamclone = '9.8'", database=DATABASE)
    for verb in (create_store, open_store):
        with pytest.raises(StoreError, match=f"format {number}, written by teamclone 9.8.*{remedy}") as caught:
            verb(url)
        assert ENCODED not in str(caught.value)


def test_rights(postgres: Server, url: str, match: Match) -> None:
    store, name, guest = create_store(url), schema_of(url), f"guest_{schema_of(url)}"
    store.add(match)
    postgres.sql(f"create role {guest} login password '{PASSWORD}'")
    as_guest = postgres.url(user=guest, schema=name)
    with pytest.raises(StoreError, match=f"permission denied for schema {name}.*docs/howto/postgresql.md"):
        open_store(as_guest)
    with pytest.raises(StoreError, match=f"permission denied for database {DATABASE}"):
        create_store(postgres.url(user=guest, schema=f"{name}_new"))
    postgres.sql(
        f"grant usage on schema {name} to {guest}; grant select on all tables in schema {name} to {guest}",
        database=DATABASE,
    )
    reader = open_store(as_guest)
    assert reader.match_ids() == [match.match_id]
    assert reader.sql("select * from frames").num_rows == len(match.frames["cycle"])
    with pytest.raises(StoreError, match="permission denied"):
        reader.add(dataclasses.replace(match, match_id="0" * 16))
    # A user who may write but not make tables.
    postgres.sql(f"grant insert, update, delete on all tables in schema {name} to {guest}", database=DATABASE)
    writer = create_store(as_guest)
    assert writer.add(dataclasses.replace(match, match_id="0" * 16)) is Added.ADDED
    assert len(store.match_ids()) == 2


@pytest.mark.parametrize(
    "query",
    [
        "with gone as (delete from matches returning 1) select * from gone",
        "select * from matches for update",
        "select 1 as n into copied",
        "select lo_create(0)",
        "select set_config('transaction_read_only', 'off', true)",
        "select 1; commit",
    ],
)
def test_questions_change_nothing(postgres: Server, url: str, match: Match, query: str) -> None:
    """Not even as the superuser."""
    create_store(url).add(match)
    with pytest.raises(UsageError) as caught:
        open_store(postgres.superuser_url(url)).sql(query)
    assert "\n" not in str(caught.value)
    assert open_store(url).match_ids() == [match.match_id]


def test_types_of_the_server_come_as_plain_ones(url: str) -> None:
    rows = create_store(url).sql(
        "select 0.5::numeric as n, sum(x::bigint) as s, '{\"a\": 1}'::json as j, array_agg(x) as l, current_date as d, "
        "null::numeric as nothing, 1 as n from generate_series(1, 3) as made(x)"
    )
    assert rows.schema.names == ["n", "s", "j", "l", "d", "nothing", "n"]
    assert [column.to_pylist()[0] for column in rows.columns][:4] == [0.5, 6.0, '{"a": 1}', [1, 2, 3]]
    assert rows.column(5).to_pylist() == [None]


# -- keys ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("superuser", [False, True], ids=["owner", "superuser"])
def test_keys_are_kept_by_the_server(postgres: Server, url: str, match: Match, superuser: bool) -> None:
    create_store(url)
    store, name = open_store(postgres.superuser_url(url) if superuser else url), schema_of(url)
    alone = dataclasses.replace(match, log=None, rcl_path=None)
    assert [store.add(alone), store.add(match), store.add(match)] == [Added.ADDED, Added.REPLACED, Added.UNCHANGED]
    keys = postgres.sql(
        f"select conrelid::regclass, contype from pg_constraint where connamespace = '{name}'::regnamespace "
        "and contype in ('p', 'f') and convalidated and conenforced",
        database=DATABASE,
    )
    assert {key.split(".")[1] for key in keys} >= {
        *(f"{table.name}|p" for table in schema.TABLES if table is not schema.PROBLEMS),
        *(f"{table.name}|f" for table in schema.MATCH_TABLES if table is not schema.MATCHES),
    }
    for statement, told in (
        (f"insert into {name}.frames (match_id, frame) values ('nowhere', 1)", "foreign key"),
        (f"insert into {name}.commands select * from {name}.commands limit 1", "unique"),
    ):
        with pytest.raises(AssertionError, match=told):
            postgres.sql(statement, database=DATABASE)
    orphans = "select 1 from {0}.{1} left join {0}.matches m using (match_id) where m.match_id is null limit 1"
    tables = [table.name for table in schema.MATCH_TABLES if table is not schema.MATCHES]
    assert not any(postgres.sql(orphans.format(name, table), database=DATABASE) for table in tables)
    store.remove(match.match_id)
    assert [postgres.sql(f"select count(*) from {name}.{table}", database=DATABASE) for table in tables] == [
        ["0"] for _ in tables
    ]


def test_tables_are_explained(postgres: Server, url: str) -> None:
    create_store(url)
    about = postgres.sql(
        f"select col_description('{schema_of(url)}.player_states'::regclass, attnum) from pg_attribute "
        f"where attrelid = '{schema_of(url)}.player_states'::regclass and attname = 'stamina'",
        database=DATABASE,
    )
    assert about == ["stamina after this cycle's recovery; NaN where the version lacks it [stamina]"]


# -- several at once, and lost connections ---------------------------------------------------------------------------


def test_several_may_make_the_same_store(url: str) -> None:
    with ThreadPoolExecutor(8) as pool:
        assert [store.match_ids() for store in pool.map(create_store, [url] * 8)] == [[]] * 8


def test_several_add_the_same_match_once(url: str, match: Match) -> None:
    create_store(url)
    with ThreadPoolExecutor(4) as pool:
        added = list(pool.map(lambda store: store.add(match), [open_store(url) for _ in range(4)]))
    assert sorted(added) == [Added.ADDED, *[Added.UNCHANGED] * 3]
    assert open_store(url).sql("select count(*) as n from frames").to_pylist() == [{"n": len(match.frames["cycle"])}]


def test_different_matches_do_not_wait_for_each_other(url: str, match: Match, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second is added while the transaction of the first is open."""
    store = create_store(url)
    inside, go_on = threading.Event(), threading.Event()
    trust = PostgresStore.__init__.__globals__["_trust_keys"]

    def slow(cursor: object) -> None:
        trust(cursor)
        if threading.current_thread() is not threading.main_thread():
            inside.set()
            assert go_on.wait(60)

    monkeypatch.setattr("teamclone.store.postgres.store._trust_keys", slow)
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(store.add, match)
        assert inside.wait(60)
        assert store.add(dataclasses.replace(match, match_id="0" * 16)) is Added.ADDED
        assert store.match_ids() == ["0" * 16]  # nothing of the first is seen
        go_on.set()
        assert first.result() is Added.ADDED
    assert len(store.match_ids()) == 2


def test_a_lost_connection_is_made_anew(postgres: Server, url: str, match: Match) -> None:
    store = create_store(url)
    for work in (lambda: store.add(match), store.match_ids, lambda: store.sql("select * from matches").num_rows):
        postgres.sql(f"select pg_terminate_backend(pid) from pg_stat_activity where usename = '{OWNER}'")
        work()
    assert store.match_ids() == [match.match_id]


def test_a_server_that_stays_away(postgres: Server, url: str, match: Match, monkeypatch: pytest.MonkeyPatch) -> None:
    store = create_store(url)
    monkeypatch.setattr("teamclone.store.postgres.connection.PAUSES_S", (0.01, 0.01))
    postgres.stop()
    try:
        with pytest.raises(StoreError, match="Connection refused") as caught:
            store.add(match)
        assert ENCODED not in str(caught.value)
        with pytest.raises(StoreError, match="Connection refused"):
            store.sql("select 1")
    finally:
        postgres.start()
    assert store.add(match) is Added.ADDED


def test_a_failure_in_the_middle_leaves_nothing(url: str, match: Match, monkeypatch: pytest.MonkeyPatch) -> None:
    store = create_store(url)

    def broken(_: Match) -> None:
        raise ArithmeticError

    monkeypatch.setattr("teamclone.store.convert.tables_of", broken)
    with pytest.raises(ArithmeticError):
        store.add(match)
    monkeypatch.undo()
    assert store.match_ids() == []
    assert store.add(match) is Added.ADDED
