"""The local page of `smajax app`: the whole way from logs to a model, in the folder and with the files of the command line.

In: a folder, requests of a browser on the same machine. Out: pages; `experiment.toml` and the commands' own result folders.

The state is the folder, and nothing else: `project` reads it as an immutable record at each request, so that a reload, a second tab, a
restarted server and the command line see the same (which steps were opened is kept in it, `opened`). `edit` changes single values of `experiment.toml`, `jobs` runs commands in processes of
their own. Each step is a file in `pages/`. Public: `server.serve`.
"""
