#!/usr/bin/env bash
# A study on a real Slurm of one node, by Snakemake, with a job killed and the node drained on the way: the same results as on this
# machine alone.  tests/cluster/slurm_test.sh path/to/palpate   (as root; packages-cluster.txt; nothing outside a folder in /tmp)
set -euo pipefail
program=$(readlink -f "$1")
for tool in munged slurmctld slurmd sbatch snakemake; do
  command -v $tool >/dev/null || { echo "cluster: SKIPPED, as $tool is missing (apt-get install the packages of packages-cluster.txt)"; exit 0; }
done
[ "$(id -u)" -eq 0 ] || { echo "cluster: SKIPPED, as it needs root to start Slurm"; exit 0; }

work=$(mktemp -d /tmp/palpate_cluster.XXXX)
node=$(hostname -s)
finish() {
  for pid in "$work"/*.pid; do [ -f "$pid" ] && kill "$(cat "$pid")" 2>/dev/null || true; done
  sleep 1
  if [ "${keep:-}" ]; then echo "cluster: logs are kept in $work"; else rm -rf "$work"; fi
}
trap finish EXIT
keep=yes

mkdir -p "$work/state" "$work/spool"
chmod 711 "$work"
head -c 1024 /dev/urandom >"$work/munge.key"
chmod 400 "$work/munge.key"
munged --force --key-file="$work/munge.key" --socket="$work/munge.socket" --pid-file="$work/munge.pid" \
  --log-file="$work/munge.log" --seed-file="$work/munge.seed"
cat >"$work/slurm.conf" <<TEXT
ClusterName=palpate
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=26817
SlurmdPort=26818
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
MinJobAge=3600
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
TEXT
export SLURM_CONF=$work/slurm.conf
# Jobs name the program as a user of the cluster would have it.
mkdir "$work/bin"
ln -s "$program" "$work/bin/palpate"
export PATH=$work/bin:$PATH
slurmctld -f "$SLURM_CONF"
slurmd -f "$SLURM_CONF" -N "$node"
for _ in $(seq 30); do [ "$(sinfo -h -o %T 2>/dev/null)" = idle ] && break || sleep 1; done
[ "$(sinfo -h -o %T)" = idle ] || { echo "cluster: the node does not come up"; tail "$work"/slurm*.log; exit 1; }

cp "$(dirname "$0")/../app/slab.yaml" "$work/slab.yaml"
cat >"$work/study.yaml" <<TEXT
title: Twenty runs
experiments:
  - name: modulus
    scene: slab.yaml
    sweep: {key: tissue.young_modulus_kPa, unit: kPa, logarithmic: true, times: {from: 1, to: 100, steps: 10}}
  - name: footprint
    scene: slab.yaml
    sweep: {key: contact.footprint_radius_mm, unit: mm, times: {from: 0.8, to: 1.2, steps: 10}}
TEXT
"$program" study "$work/study.yaml" -o "$work/local" >"$work/local.log" 2>&1
"$program" study "$work/study.yaml" --export snakemake -o "$work/cluster" >"$work/export.log" 2>&1

snakemake --directory "$work" --snakefile "$work/cluster/Snakefile" --profile "$work/cluster/profile" >"$work/snakemake.log" 2>&1 &
snakemake=$!
running() { squeue -h -t R -o %i | head -1; }
for _ in $(seq 120); do [ "$(find "$work/cluster" -name result.json | wc -l)" -ge 3 ] && [ "$(running)" ] && break || sleep 0.5; done
victim=$(running)
[ "$victim" ] || { echo "cluster: no job runs"; tail "$work/snakemake.log"; exit 1; }
scancel "$victim"
echo "cluster: job $victim killed"
scontrol update nodename="$node" state=drain reason=test
sleep 5
[[ $(sinfo -h -o %T) == dra* ]] && echo "cluster: node drained"
scontrol update nodename="$node" state=resume
wait $snakemake || { echo "cluster: snakemake did not come to its end"; tail -20 "$work/snakemake.log"; exit 1; }

# Every column but the times; the last digits hang on the order in which threads add.
/usr/bin/python3 - "$work" <<'PYTHON'
import csv, glob, sys
def read(folder):
    path, = glob.glob(f"{sys.argv[1]}/{folder}/**/results.csv", recursive=True)
    return {row[next(iter(row))]: row for row in csv.DictReader(open(path))}
local, cluster = read("local"), read("cluster")
assert len(local) == 20 and local.keys() == cluster.keys(), (len(local), len(cluster))
different = []
for name, row in local.items():
    for column, value in row.items():
        if column.endswith(("_ms", "_s")) or "per_second" in column:
            continue
        other = cluster[name][column]
        try:
            same = abs(float(value) - float(other)) <= 1e-3 * abs(float(value)) + 1e-9
        except ValueError:
            same = value == other
        if not same:
            different.append((name, column, value, other))
for line in different:
    print("cluster: differs", *line)
print(f"cluster: {len(local)} runs, {len(next(iter(local.values())))} columns, {len(different)} values differ")
sys.exit(bool(different))
PYTHON
keep=
