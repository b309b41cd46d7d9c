-- An arm of two flexible links that turn in a horizontal plane, with a motor at each joint: what docs/casadi.md moves
-- with the least effort and controls predictively.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 2, { from = 1 })
local p  = rd.parameters {
  { "L", 0.8, "m" }, { "width", 0.004, "m" }, { "height", 0.03, "m" }, { "E", 7e10, "Pa" }, { "nu", 0.33, "1" },
  { "rho", 2700, "kg/m^3" }, { "eta", 2e-3, "s" }, { "rotor", 0.02, "kg m^2" }, { "elbow", 0.4, "kg" }, { "load", 0.2, "kg" },
}
rd.input("shoulder", 0, "N m")
rd.input("elbow", 0, "N m")

local function link(name, on)
  return { name, on = on, joint = "psi", rotor = { psi = { inertia = p.rotor } },
           beam = { length = p.L, section = rd.rectangle(p.width, p.height), E = p.E, nu = p.nu, rho = p.rho, eta = p.eta,
                    rfe = n, dofs = "psi" } }
end

return rd.model {
  name = "arm",
  links = {
    link("upper"), { "motor", on = "upper.tip", mass = p.elbow },
    link("fore", "motor"), { "hand", on = "fore.tip", mass = p.load },
  },
  points = { elbow = "motor", hand = "hand" },
  forces = function(s) return { upper_psi = s.inputs.shoulder, fore_psi = s.inputs.elbow } end,
}
