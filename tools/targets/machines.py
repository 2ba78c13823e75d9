"""The machines that tools/target flies on: how each is built and run."""
import dataclasses
import pathlib

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SEMIHOSTING = ["-display", "none", "-monitor", "none", "-serial", "none", "-chardev", "stdio,id=sh",
               "-semihosting-config", "enable=on,target=native,chardev=sh"]


@dataclasses.dataclass(frozen=True)
class Machine:
    name: str
    what: str
    emulator: tuple = ()  # nothing: this very machine
    prefix: str = ""  # of its binutils
    cmake: tuple = ()
    ticks: float = 0.0  # of the port's counter for an instruction; 0: there is none
    toolchain: bool = True

    @property
    def system(self):
        """Is it a whole machine, its image run by semihosting?"""
        return bool(self.emulator) and self.emulator[0].startswith("qemu-system")

    def command(self, image, plugin=None):
        plug = ["-plugin", plugin] if plugin else []
        if not self.emulator:
            return [str(image)]
        if self.system:
            return [*self.emulator, *SEMIHOSTING, *plug, "-kernel", str(image)]
        return [*self.emulator, *plug, str(image)]


def host(name, what, compiler, flags):
    return Machine(name, what, cmake=(f"-DCMAKE_C_COMPILER={compiler}", "-DCMAKE_BUILD_TYPE=None",
                                      f"-DCMAKE_C_FLAGS={flags}"), toolchain=False)


def linux(name, what, emulator, prefix):
    return Machine(name, what, (emulator,), prefix)


ALL = [
    host("host-gcc-O0", "x86-64, gcc -O0", "gcc", "-O0"),
    host("host-gcc-O3", "x86-64, gcc -O3", "gcc", "-O3"),
    host("host-gcc-v3", "x86-64-v3, gcc -O3", "gcc", "-O3 -march=x86-64-v3"),
    host("host-clang-O2", "x86-64, clang -O2", "clang", "-O2"),
    host("host-clang-v3", "x86-64-v3, clang -O3", "clang", "-O3 -march=x86-64-v3"),
    Machine("cortex-m4f", "Cortex-M4F, STM32F405, bare metal",
            ("qemu-system-arm", "-M", "netduinoplus2", "-icount", "shift=0"), "arm-none-eabi-", ticks=1.0),
    Machine("cortex-m7", "Cortex-M7, MPS2 AN500, bare metal",
            ("qemu-system-arm", "-M", "mps2-an500", "-icount", "shift=7"), "arm-none-eabi-", ticks=3.2),
    Machine("cortex-m55", "Cortex-M55 with Helium, MPS3 AN547, bare metal",
            ("qemu-system-arm", "-M", "mps3-an547"), "arm-none-eabi-"),
    Machine("rv32imafc", "RISC-V RV32IMAFC, virt, bare metal",
            ("qemu-system-riscv32", "-M", "virt", "-bios", "none", "-icount", "shift=0"), "riscv64-unknown-elf-", ticks=1.0),
    linux("aarch64", "AArch64, Linux user emulation", "qemu-aarch64", "aarch64-linux-gnu-"),
    linux("armhf", "Armv7-A, Linux user emulation", "qemu-arm", "arm-linux-gnueabihf-"),
    linux("ppc64", "PowerPC, big-endian, Linux user emulation", "qemu-ppc64", "powerpc64-linux-gnu-"),
    linux("s390x", "s390x, big-endian, Linux user emulation", "qemu-s390x", "s390x-linux-gnu-"),
]


def runs_here(machine):
    """Builds for x86-64-v3 need a processor with AVX2."""
    return not machine.name.endswith("-v3") or " avx2 " in pathlib.Path("/proc/cpuinfo").read_text()


def find(name):
    return next(machine for machine in ALL if machine.name == name)


# Boards with 16 MB of RAM for whole programs with a C library (tools/targets/whole), by the machine whose core they have.
LARGE = {
    "cortex-m4f": Machine("cortex-m4f-large", "Cortex-M4F, MPS2 AN386 with external RAM, bare metal",
                          ("qemu-system-arm", "-M", "mps2-an386"), "arm-none-eabi-"),
    "cortex-m7": Machine("cortex-m7-large", "Cortex-M7, MPS2 AN500 with external RAM, bare metal",
                         ("qemu-system-arm", "-M", "mps2-an500"), "arm-none-eabi-"),
    "cortex-m55": Machine("cortex-m55-large", "Cortex-M55 with Helium, MPS3 AN547 with DDR, bare metal",
                          ("qemu-system-arm", "-M", "mps3-an547"), "arm-none-eabi-"),
}
