# Turns the logs of the images into a table and a JSON report. Each log ends with the lines that
# ci/firmware.sh adds about the image. Variables: integrator, report (the JSON file).

FNR == 1 { n++ }

{
    split("", v)
    for (i = 2; i <= NF; i++) {
        at = index($i, "=")
        v[substr($i, 1, at - 1)] = substr($i, at + 1)
    }
}

$1 == "image" { board[n] = v["board"] }
$1 == "size" { workspace[n] = v["workspace"]; solver[n] = v["solver"] }
$1 == "stack" { stack[n] = v["used"] }
$1 == "calibration" { calibration[n] = v["expected"] " " v["counted"] " " v["resolution"] }
$1 == "about" { for (key in v) about[n, key] = v[key] }

$1 == "count" { kernels[n] = kernels[n] separated(kernels[n]) pair(v["name"], v["instructions"]) }

$1 == "stage" { stages[n] = stages[n] ", " quoted(v["name"], v) }
$1 == "plan" {
    plans[n]++
    plan[n, plans[n]] = "\"scenario\": \"" v["scenario"] "\", \"status\": " v["status"] \
        ", \"output\": \"" v["output"] "\"" stages[n]
    stages[n] = ""
    solved[n] += v["status"] == 0
}
$1 == "phase" {
    phases[n, plans[n]] = phases[n, plans[n]] separated(phases[n, plans[n]]) \
        pair(v["name"], v["instructions"])
    if (!(v["name"] in known)) {
        known[v["name"]] = 1
        name[++names] = v["name"]
    }
    sum[n, v["name"]] += v["instructions"]
}

function separated(list) { return list == "" ? "" : ", " }
function quoted(name, v) {
    return sprintf("\"%s\": {\"status\": %d, \"iterations\": %d, \"corrections\": %d, \"qp_iterations\": %d}", \
        name, v["status"], v["iterations"], v["corrections"], v["qp_iterations"])
}
function pair(key, value) { return sprintf("\"%s\": %.0f", key, value) }
function mean(n, name) { return plans[n] ? sum[n, name] / plans[n] : 0 }
# At one instruction a cycle, which is an estimate and no measurement.
function milliseconds(n) { return mean(n, "total") / about[n, "clock_hz"] * 1e3 }

END {
    printf "\nsize in memory [bytes], mean instructions of %d plans (%s)\n\n", plans[1], integrator
    row("")
    for (t = 1; t <= n; t++) printf "%18s", board[t]
    print ""
    bytes("image", about, "image")
    row("workspace"); for (t = 1; t <= n; t++) printf "%18d", workspace[t]; print ""
    row("solver"); for (t = 1; t <= n; t++) printf "%18d", solver[t]; print ""
    bytes("static memory in all", about, "static")
    row("stack, high-water"); for (t = 1; t <= n; t++) printf "%18d", stack[t]; print ""
    for (i = 1; i <= names; i++) {
        row(name[i])
        for (t = 1; t <= n; t++) printf "%18.0f", mean(t, name[i])
        print ""
    }
    row("plans solved"); for (t = 1; t <= n; t++) printf "%18s", solved[t] + 0 " of " plans[t]; print ""
    bytes("same bits as host", about, "equal")
    bytes("free of panics", about, "panic_free")
    row("ESTIMATE [ms]")
    for (t = 1; t <= n; t++) {
        hz = about[t, "clock_hz"] + 0
        printf "%18s", hz ? sprintf("%.0f (%d MHz)", milliseconds(t), hz / 1e6) : "-"
    }
    print "\n\nThe estimate is instructions over clock rate, as if each took one cycle: no measurement."
    write()
}

function truth(word) { return word == "yes" ? "true" : "false" }
function row(title) { printf "%-24s", title }
function bytes(title, table, key,    t) {
    row(title)
    for (t = 1; t <= n; t++) printf "%18s", table[t, key]
    print ""
}

function write(    t, i, c) {
    printf "{\"format\": \"remora-firmware/1\", \"integrator\": \"%s\", \"targets\": [", integrator > report
    for (t = 1; t <= n; t++) {
        split(calibration[t], c, " ")
        gsub(/["]/, "", about[t, "toolchain"])
        gsub(/_/, " ", about[t, "toolchain"])
        printf "%s\n {\"target\": \"%s\", \"board\": \"%s\", \"cpu\": \"%s\", \"toolchain\": \"%s\",\n", \
            (t > 1 ? "," : ""), about[t, "target"], board[t], about[t, "cpu"], about[t, "toolchain"] > report
        printf "  \"image_bytes\": %d, \"workspace_bytes\": %d, \"solver_bytes\": %d,", \
            about[t, "image"], workspace[t], solver[t] > report
        printf " \"static_bytes\": %d, \"stack_bytes\": %d,\n", about[t, "static"], stack[t] > report
        printf "  \"same_bits_as_host\": %s, \"panic_free\": %s,\n", \
            truth(about[t, "equal"]), truth(about[t, "panic_free"]) > report
        printf "  \"counter\": {\"expected\": %d, \"counted\": %d, \"resolution\": %d},\n", \
            c[1], c[2], c[3] > report
        if (about[t, "clock_hz"] + 0)
            printf "  \"estimate\": {\"clock_hz\": %d, \"instructions_per_cycle\": 1, \"plan_ms\": %.1f},\n", \
                about[t, "clock_hz"], milliseconds(t) > report
        printf "  \"kernels\": {%s},\n  \"plans\": [", kernels[t] > report
        for (i = 1; i <= plans[t]; i++)
            printf "%s\n   {%s, \"instructions\": {%s}}", (i > 1 ? "," : ""), plan[t, i], phases[t, i] > report
        printf "]}" > report
    }
    print "]}" > report
}
