"""The whole paper at one command: figures, tables, and a page that holds its claims against what is measured."""
