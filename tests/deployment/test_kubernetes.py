"""Checks that the manifests of docker/kubernetes agree with each other and with the server."""

import copy
import os
import pathlib
import re
import signal
import socket
import subprocess
import time
import unittest
import urllib.request

import yaml

FOLDER = pathlib.Path(os.environ["PARTIEMC_SOURCE_DIR"], "docker/kubernetes")
PROGRAM = os.environ["PARTIEMC_SERVER_PROGRAM"]

# Where the cluster takes each kind from.
VERSIONS = {
    "ServiceAccount": "v1",
    "Service": "v1",
    "Deployment": "apps/v1",
    "PodDisruptionBudget": "policy/v1",
    "HorizontalPodAutoscaler": "autoscaling/v2",
    "NetworkPolicy": "networking.k8s.io/v1",
}


def merged(below, above):
    """A strategic merge, as kustomize patches: maps by key, lists of maps by `name`, else replaced."""
    if isinstance(below, dict) and isinstance(above, dict):
        result = dict(below)
        for key, value in above.items():
            result[key] = merged(below[key], value) if key in below else value
        return result
    if isinstance(below, list) and isinstance(above, list) and all(
            isinstance(each, dict) and "name" in each for each in below + above):
        result = {each["name"]: each for each in below}
        for each in above:
            result[each["name"]] = merged(result.get(each["name"], {}), each)
        return list(result.values())
    return above


class Manifests:
    """The output of kustomize for a folder: objects by kind and name, settings, and the files read."""

    def __init__(self, folder):
        self.objects, self.settings, self.files = {}, {}, set()
        self.proxy_configuration = None
        self.listed = set()
        self.read(folder)

    def read(self, folder):
        kustomization = yaml.safe_load((folder / "kustomization.yaml").read_text())
        self.files |= {path.resolve() for path in folder.glob("*.yaml")}
        self.listed.add((folder / "kustomization.yaml").resolve())
        for resource in kustomization["resources"]:
            path = (folder / resource).resolve()
            if path.is_dir():
                self.read(path)
                continue
            self.listed.add(path)
            for one in yaml.safe_load_all(path.read_text()):
                self.objects[one["kind"], one["metadata"]["name"]] = one
        for generated in kustomization.get("configMapGenerator", []):
            if generated["name"] == "partiemc-proxy":
                self.proxy_configuration = (folder / generated["files"][0]).read_text()
                continue
            if generated["name"] != "partiemc-settings":
                raise ValueError(f"unknown settings {generated['name']}")
            self.settings.update(literal.split("=", 1) for literal in generated["literals"])
        for patch in kustomization.get("patches", []):
            path = (folder / patch["path"]).resolve()
            self.listed.add(path)
            one = yaml.safe_load(path.read_text())
            key = one["kind"], one["metadata"]["name"]
            self.objects[key] = merged(self.objects[key], one)

    @property
    def pod(self):
        return self.objects["Deployment", "partiemc"]["spec"]["template"]

    def container(self, name):
        """None where the pod has no such container."""
        return next((one for one in self.pod["spec"]["containers"] if one["name"] == name), None)

    @property
    def server(self):
        return self.container("server")

    @property
    def proxy(self):
        return self.container("proxy")

    @property
    def proxy_settings(self):
        return {one["name"]: one["value"] for one in self.proxy["env"]} if self.proxy else {}


def server_variables():
    text = subprocess.run([PROGRAM, "--help"], capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"\(Env:(PARTIEMC_[A-Z_]+)\)", text))


def planned_mib(settings, memory_budget, threads):
    """The memory that the server reports as its maximum."""
    text = subprocess.run(
        [PROGRAM, "--print-memory-plan", "--memory-budget", str(memory_budget), "--threads",
         str(threads)], env={**os.environ, **settings}, capture_output=True, text=True,
        check=True).stdout
    return float(text.splitlines()[-1].split()[0])


def port_of(address):
    return int(address.rsplit(":", 1)[1])


def problems_of_container(container, spec):
    """Its privileges and memory."""
    found = []
    resources = container["resources"]
    if resources["requests"]["memory"] != resources["limits"]["memory"]:
        found.append("memory is promised that may not be there")
    security = {**spec["securityContext"], **container["securityContext"]}
    for key, wanted in (("runAsNonRoot", True), ("allowPrivilegeEscalation", False),
                        ("readOnlyRootFilesystem", True), ("capabilities", {"drop": ["ALL"]}),
                        ("seccompProfile", {"type": "RuntimeDefault"})):
        if security.get(key) != wanted:
            found.append(f"{key} is {security.get(key)}")
    return found


def problems_of_proxy(manifests):
    """Of the proxy in front of the server: addresses, configuration, drain."""
    settings, own, found = manifests.settings, manifests.proxy_settings, []
    shipped = (FOLDER.parent / "haproxy.cfg").read_text()
    if manifests.proxy_configuration != shipped:
        found.append("haproxy.cfg differs from docker/haproxy.cfg")
    for name in own:
        if name not in shipped:
            found.append(f"haproxy.cfg has no {name}")
    for theirs, ours in (("PARTIEMC_SERVER", "PARTIEMC_ADDRESS"),
                         ("PARTIEMC_SERVER_WEB", "PARTIEMC_WEB")):
        if own[theirs] != settings[ours] or not own[theirs].startswith("127.0.0.1:"):
            found.append(f"{theirs} is {own[theirs]}, {ours} {settings[ours]}")
    for name in ("PARTIEMC_CONNECTIONS_PER_ADDRESS", "PARTIEMC_NEW_CONNECTIONS_PER_ADDRESS"):
        if settings.get(name) != "0":
            found.append(f"{name} limits all clients of the proxy together")
    wait = manifests.proxy["lifecycle"]["preStop"]["exec"]["command"]
    if wait != ["sleep", settings["PARTIEMC_DRAIN_DELAY"]]:
        found.append(f"the proxy admits streams for {wait}")
    return found


def problems(manifests):
    """Errors, one line each."""
    found = [f"{path.name} is not listed" for path in manifests.files - manifests.listed]
    for (kind, name), one in manifests.objects.items():
        if VERSIONS.get(kind) != one["apiVersion"]:
            found.append(f"{kind} {name}: apiVersion {one['apiVersion']}")
    labels = manifests.pod["metadata"]["labels"]
    spec, server, settings = manifests.pod["spec"], manifests.server, manifests.settings

    def select(what, selector):
        if not selector or any(labels.get(key) != value for key, value in selector.items()):
            found.append(f"{what} selects {selector}, the pods have {labels}")

    of = manifests.objects
    select("the deployment", of["Deployment", "partiemc"]["spec"]["selector"]["matchLabels"])
    select("the budget", of["PodDisruptionBudget", "partiemc"]["spec"]["selector"]["matchLabels"])
    select("the policy", of["NetworkPolicy", "partiemc"]["spec"]["podSelector"]["matchLabels"])
    for constraint in spec["topologySpreadConstraints"]:
        select("the spread", constraint["labelSelector"]["matchLabels"])

    ports = {port["name"]: port["containerPort"] for port in server["ports"]}
    # A port belongs to the pod, whichever container listens on it.
    listening = {"PARTIEMC_PROXY": settings["PARTIEMC_ADDRESS"],
                 "PARTIEMC_PROXY_WEB": settings["PARTIEMC_WEB"],
                 "PARTIEMC_METRICS": settings["PARTIEMC_METRICS"]} | manifests.proxy_settings
    for name, variable in (("grpc", "PARTIEMC_PROXY"), ("web", "PARTIEMC_PROXY_WEB"),
                           ("metrics", "PARTIEMC_METRICS")):
        if ports.get(name) != port_of(listening[variable]):
            found.append(f"port {name} is {ports.get(name)}, {variable} {listening[variable]}")
    if manifests.proxy:
        found += problems_of_proxy(manifests)
    asked = {port["port"] for rule in of["NetworkPolicy", "partiemc"]["spec"]["ingress"]
             for port in rule["ports"]}
    asked.add(server["livenessProbe"]["httpGet"]["port"])
    for (kind, name), one in of.items():
        if kind != "Service":
            continue
        select(f"service {name}", one["spec"]["selector"])
        asked |= {port["targetPort"] for port in one["spec"]["ports"]}
        for port in one["spec"]["ports"]:
            if port["port"] != ports.get(port["targetPort"]):
                found.append(f"service {name}: port {port['port']} is not that of the server")
    found += [f"nobody listens on port {name}" for name in asked - set(ports)]

    known = server_variables()
    found += [f"the server knows no {name}" for name in set(settings) - known]
    if server["envFrom"] != [{"configMapRef": {"name": "partiemc-settings"}}]:
        found.append("the server does not get its settings")
    stop = int(settings["PARTIEMC_DRAIN_DELAY"]) + int(settings["PARTIEMC_GRACE_SECONDS"]) + 2
    if spec["terminationGracePeriodSeconds"] < stop:
        found.append(f"killed after {spec['terminationGracePeriodSeconds']} s, needs {stop}")
    ready = server["readinessProbe"]
    unnoticed = ready["periodSeconds"] * ready["failureThreshold"]
    if 2 * unnoticed > int(settings["PARTIEMC_DRAIN_DELAY"]):
        found.append(f"a drain is noticed after {unnoticed} s, when streams are told to go")
    if ready["exec"]["command"] != ["partiemc-server", "--health-check"]:
        found.append("readiness is not asked for")
    if of["HorizontalPodAutoscaler", "partiemc"]["spec"]["scaleTargetRef"]["name"] != "partiemc":
        found.append("the autoscaler scales something else")
    if ("ServiceAccount", spec["serviceAccountName"]) not in of:
        found.append("no such account")
    # Without flags the budget is half of the limit.
    limits = server["resources"]["limits"]
    mib = int(limits["memory"].removesuffix("Gi")) * 1024
    # The server does not start with a misspelt variable.
    planned = planned_mib({name: value for name, value in settings.items() if name in known},
                          mib * 2**20 // 2, limits["cpu"])
    if planned > mib:
        found.append(f"the server may take {planned:.0f} MiB, its limit is {mib}")

    mounts = {}
    for container in spec["containers"]:
        found += problems_of_container(container, spec)
        mounts |= {mount["name"]: mount for mount in container.get("volumeMounts", [])}
    volumes = {volume["name"]: volume for volume in spec.get("volumes", [])}
    if set(mounts) != set(volumes):
        found.append(f"volumes {sorted(volumes)}, mounts {sorted(mounts)}")
    files = {name: value for name, value in (settings | manifests.proxy_settings).items()
             if re.search("_(CERT|KEY|FILE)$", name)}
    for name, path in files.items():
        if not any(path.startswith(mount["mountPath"] + "/") for mount in mounts.values()):
            found.append(f"{name} {path} is in no volume")
    is_secure = "PARTIEMC_PROXY_CERT" in files or {"PARTIEMC_TLS_CERT",
                                                   "PARTIEMC_TLS_KEY"} <= set(files)
    if is_secure == (settings["PARTIEMC_INSECURE"] == "true"):
        found.append("neither TLS nor --insecure, or both")
    return found


class Kubernetes(unittest.TestCase):
    def test_manifests_agree_with_each_other_and_the_server(self):
        for folder in ("base", "production"):
            with self.subTest(folder):
                self.assertEqual(problems(Manifests(FOLDER / folder)), [])

    def test_production_is_secure(self):
        manifests = Manifests(FOLDER / "production")
        settings = manifests.settings
        for name in ("TOKEN_FILE", "CHECKPOINT_KEY_FILE"):
            self.assertIn("PARTIEMC_" + name, settings)
        self.assertIn("PARTIEMC_PROXY_CERT", manifests.proxy_settings)
        self.assertEqual(settings["PARTIEMC_INSECURE"], "false")

    def test_each_violation_is_found(self):
        def planted(change, words):
            manifests = copy.deepcopy(Manifests(FOLDER / "production"))
            change(manifests)
            found = problems(manifests)
            self.assertTrue(any(words in line for line in found), (words, found))

        def setting(name, value):
            return lambda m: m.settings.update({name: value})

        def spec(kind, name="partiemc"):
            return lambda m: m.objects[kind, name]["spec"]

        planted(lambda m: m.files.add(FOLDER / "other.yaml"), "other.yaml is not listed")
        planted(lambda m: m.objects["Service", "partiemc"].update(apiVersion="v2"), "apiVersion")
        planted(lambda m: m.pod["metadata"].update(labels={"app": "other"}), "selects")
        planted(lambda m: spec("PodDisruptionBudget")(m).update(selector={"matchLabels": {}}),
                "the budget selects")
        planted(setting("PARTIEMC_METRICS", "0.0.0.0:9465"), "port metrics is 9464")
        planted(setting("PARTIEMC_ADDRESS", "127.0.0.1:50052"), "PARTIEMC_SERVER is 127.0.0.1:50061")
        planted(setting("PARTIEMC_NEW_CONNECTIONS_PER_ADDRESS", "9"), "limits all clients")
        planted(lambda m: m.proxy["env"][0].update(value=":1"), "port grpc is 50051")
        planted(lambda m: m.proxy["env"][0].update(name="PARTIEMC_PROXI"), "no PARTIEMC_PROXI")
        planted(lambda m: m.proxy["securityContext"].pop("capabilities"), "capabilities")
        planted(lambda m: setattr(m, "proxy_configuration", ""), "haproxy.cfg differs")
        planted(setting("PARTIEMC_DRAIN_DELAY", "11"), "the proxy admits streams")
        planted(lambda m: spec("Service")(m)["ports"][0].update(port=1), "port 1")
        planted(lambda m: spec("Service")(m)["ports"][0].update(targetPort="rpc"), "port rpc")
        planted(setting("PARTIEMC_MAX_STREEMS", "3"), "knows no PARTIEMC_MAX_STREEMS")
        planted(lambda m: m.server.update(envFrom=[]), "does not get its settings")
        planted(setting("PARTIEMC_GRACE_SECONDS", "60"), "needs 72")
        planted(setting("PARTIEMC_DRAIN_DELAY", "6"), "noticed after 4 s")
        planted(lambda m: m.server["readinessProbe"].update(exec={"command": ["true"]}), "readiness")
        planted(lambda m: m.pod["spec"].update(serviceAccountName="root"), "no such account")
        planted(lambda m: m.server["resources"]["requests"].update(memory="1Gi"), "memory")
        planted(lambda m: m.server["resources"]["limits"].update(cpu="500"), "may take")
        planted(lambda m: m.server["securityContext"].pop("capabilities"), "capabilities")
        planted(lambda m: m.server["securityContext"].update(readOnlyRootFilesystem=False), "readOnly")
        planted(lambda m: m.server["volumeMounts"].pop(), "volumes")
        planted(setting("PARTIEMC_TOKEN_FILE", "/etc/tokens"), "in no volume")
        planted(setting("PARTIEMC_INSECURE", "true"), "or both")

    def test_a_server_with_these_settings_drains_as_they_say(self):
        """Ready, then not; alive until it ends, with 0."""
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            metrics = free.getsockname()[1]
        settings = Manifests(FOLDER / "base").settings
        port_file = pathlib.Path(os.environ.get("TMPDIR", "/tmp"), f"partiemc-port-{os.getpid()}")
        settings |= {"PARTIEMC_ADDRESS": "127.0.0.1:0", "PARTIEMC_WEB": "127.0.0.1:0",
                     "PARTIEMC_METRICS": f"127.0.0.1:{metrics}", "PARTIEMC_DRAIN_DELAY": "3",
                     "PARTIEMC_PORT_FILE": str(port_file)}
        self.addCleanup(port_file.unlink)
        # Kubernetes sets these for the Service `partiemc`.
        links = {"PARTIEMC_SERVICE_HOST": "10.0.0.11", "PARTIEMC_SERVICE_PORT": "50051",
                 "PARTIEMC_SERVICE_PORT_GRPC": "50051", "PARTIEMC_PORT": "tcp://10.0.0.11:50051",
                 "PARTIEMC_PORT_50051_TCP": "tcp://10.0.0.11:50051",
                 "PARTIEMC_PORT_50051_TCP_PROTO": "tcp", "PARTIEMC_PORT_50051_TCP_PORT": "50051",
                 "PARTIEMC_PORT_50051_TCP_ADDR": "10.0.0.11"}
        environment = {**os.environ, **links, **settings}
        server = subprocess.Popen([PROGRAM], env=environment, stderr=subprocess.DEVNULL)
        self.addCleanup(server.kill)
        for _ in range(300):
            if port_file.exists() and port_file.read_text().endswith("\n"):
                break
            time.sleep(0.1)
        environment["PARTIEMC_ADDRESS"] = port_file.read_text().strip()

        def is_ready():
            return subprocess.run([PROGRAM, "--health-check"], env=environment,
                                  capture_output=True).returncode == 0

        def is_alive():
            with urllib.request.urlopen(f"http://127.0.0.1:{metrics}/metrics") as answer:
                return answer.status == 200

        self.assertTrue(is_ready() and is_alive())
        server.send_signal(signal.SIGTERM)
        while is_ready():
            self.assertIsNone(server.poll(), "it went while it was ready")
        self.assertTrue(is_alive())
        self.assertEqual(server.wait(60), 0)


if __name__ == "__main__":
    unittest.main()
