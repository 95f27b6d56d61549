# Turns the logs of the images into tables and a JSON report (`remora-firmware/2`). For each target in
# turn come the lines that ci/firmware.sh says about it, the log of its tests, and those of its runs;
# each log ends with a line of the script's. Variables: kernels (yes or no: print them), report (the
# JSON file).

{
    split("", v)
    for (i = 2; i <= NF; i++) {
        at = index($i, "=")
        v[substr($i, 1, at - 1)] = substr($i, at + 1)
    }
}

$1 == "about" && "target" in v { n++ }
$1 == "about" { for (key in v) about[n, key] = v[key] }
$1 == "image" { about[n, "board"] = v["board"]; begin() }
$1 == "size" { for (key in v) about[n, key] = v[key] }
$1 == "calibration" {
    counter = pair("expected", v["expected"]) ", " pair("counted", v["counted"]) ", " \
        pair("resolution", v["resolution"])
}
$1 == "stack" {
    about[n, "stack_size"] = v["size"]
    if (!(v["entry"] in stack)) entry[++entries] = v["entry"]
    if (v["used"] + 0 > stack[v["entry"]] + 0) stack[v["entry"]] = v["used"]
}
$1 == "count" {
    counts = counts separated(counts) "{" word("name", v["name"]) ", " pair("calls", v["calls"]) \
        ", " pair("instructions", v["instructions"]) "}"
    if (v["name"] == "open_model") opening = v["instructions"]
    else called[n] = called[n] sprintf("%-30s%6d%18d\n", v["name"], v["calls"], v["instructions"])
}
$1 == "stage" {
    stages = stages ", " quoted(v["name"]) ": {" pair("status", v["status"]) ", " \
        pair("iterations", v["iterations"]) ", " pair("corrections", v["corrections"]) ", " \
        pair("qp_iterations", v["qp_iterations"]) "}"
}
$1 == "plan" {
    count++
    solved += v["status"] == 0 && v["verified"] == 1
    plan = word("scenario", v["scenario"]) ", " pair("status", v["status"]) ", \"verified\": " \
        (v["verified"] ? "true" : "false") ", " pair("start", v["start"]) ", " \
        word("output", v["output"]) stages
    stages = ""
}
$1 == "phase" {
    phases = phases separated(phases) pair(v["name"], v["instructions"])
    if (!(v["name"] in known)) {
        known[v["name"]] = 1
        name[++names] = v["name"]
    }
    sum[v["name"]] += v["instructions"]
    if (v["name"] == "total") {
        plans = plans separated(plans) "\n    {" plan ", \"instructions\": {" phases "}}"
        phases = ""
    }
}
$1 == "run" && "tests" in v { tests[n] = counts }
$1 == "run" && "start" in v { end_run(v["integrator"], v["start"]) }

# A new log begins.
function begin() {
    counts = plans = stages = phases = ""
    count = solved = opening = entries = 0
    split("", stack)
    split("", sum)
}

# A log's numbers go into the report and into the table of its integrator and start.
function end_run(integrator, start,    run, marks, i) {
    run = start " start, " integrator
    if (!((n, run) in runs)) {
        if (!(run in seen)) title[++titles] = run
        seen[run] = 1
    }
    for (i = 1; i <= entries; i++) marks = marks separated(marks) pair(entry[i], stack[entry[i]])
    for (i = 1; i <= names; i++) mean[n, run, name[i]] = count ? sum[name[i]] / count : 0
    marked[n, run] = stack["plan"]
    solved_of[n, run] = solved + 0 " of " count
    planned[run] = count
    equal[n, run] = v["equal"]
    runs[n] = runs[n] separated(runs[n]) "\n   {" word("integrator", integrator) ", " \
        word("start", start) ", \"same_bits_as_host\": " truth(v["equal"]) \
        ", \"repeatable\": " truth(v["repeated"]) ",\n    \"counter\": {" counter "}, " \
        "\"open_model_instructions\": " (opening ? sprintf("%.0f", opening) : "null") \
        ", \"stack_bytes\": {" marks "},\n    \"plans\": [" plans "]}"
}

function separated(list) { return list == "" ? "" : ", " }
function quoted(text) { return "\"" text "\"" }
function word(key, value) { return quoted(key) ": " quoted(value) }
function pair(key, value) { return sprintf("\"%s\": %.0f", key, value) }
function truth(text) { return text == "yes" ? "true" : text == "no" ? "false" : "null" }

END {
    print "\nbytes\n"
    head("")
    about_row("image", "image")
    about_row("models", "model")
    about_row("workspace", "workspace")
    about_row("solver", "solver")
    about_row("network's memory", "network")
    about_row("static memory in all", "static")
    about_row("free of panics", "panic_free")
    for (i = 1; i <= titles; i++) table(title[i])
    print "\nThe estimate is instructions over clock rate, as if each took one cycle: no measurement."
    if (kernels == "yes")
        for (t = 1; t <= n; t++) printf "\n%s: calls and instructions\n%s", about[t, "board"], called[t]
    write()
}

function table(run,    i, t, hz) {
    printf "\n%s: mean instructions of %d plans\n\n", run, planned[run]
    head("")
    for (i = 1; i <= names; i++) {
        row(name[i])
        for (t = 1; t <= n; t++) printf "%18.0f", mean[t, run, name[i]]
        print ""
    }
    row("stack, high-water"); for (t = 1; t <= n; t++) printf "%18d", marked[t, run]; print ""
    row("plans solved"); for (t = 1; t <= n; t++) printf "%18s", solved_of[t, run]; print ""
    row("same bits as host"); for (t = 1; t <= n; t++) printf "%18s", equal[t, run]; print ""
    row("ESTIMATE [ms]")
    for (t = 1; t <= n; t++) {
        hz = about[t, "clock_hz"] + 0
        printf "%18s", hz ? sprintf("%.0f (%d MHz)", mean[t, run, "total"] / hz * 1e3, hz / 1e6) : "-"
    }
    print ""
}

function row(title) { printf "%-24s", title }
function head(title,    t) {
    row(title)
    for (t = 1; t <= n; t++) printf "%18s", about[t, "board"]
    print ""
}
function about_row(title, key,    t) {
    row(title)
    for (t = 1; t <= n; t++) printf "%18s", about[t, key]
    print ""
}

function write(    t, hz) {
    printf "{\"format\": \"remora-firmware/2\", \"targets\": [" > report
    for (t = 1; t <= n; t++) {
        gsub(/["]/, "", about[t, "toolchain"])
        gsub(/_/, " ", about[t, "toolchain"])
        hz = about[t, "clock_hz"] + 0
        printf "%s\n {%s, %s, %s, %s, \"clock_hz\": %s,\n", (t > 1 ? "," : ""), \
            word("target", about[t, "target"]), word("board", about[t, "board"]), \
            word("cpu", about[t, "cpu"]), word("toolchain", about[t, "toolchain"]), \
            (hz ? sprintf("%d", hz) : "null") > report
        printf "  %s, %s, %s, %s,\n", pair("image_bytes", about[t, "image"]), \
            pair("model_bytes", about[t, "model"]), pair("static_bytes", about[t, "static"]), \
            pair("stack_size_bytes", about[t, "stack_size"]) > report
        printf "  %s, %s, %s,\n", pair("workspace_bytes", about[t, "workspace"]), \
            pair("solver_bytes", about[t, "solver"]), \
            pair("network_bytes", about[t, "network"]) > report
        printf "  \"panic_free\": %s,\n  \"parts\": [%s],\n  \"runs\": [%s]}", \
            truth(about[t, "panic_free"]), tests[t], runs[t] > report
    }
    print "]}" > report
}
