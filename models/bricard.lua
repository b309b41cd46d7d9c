-- Bricard's linkage: six hinges, each at right angles to the next, join rods of equal length along the edges of a cube;
-- the ground is the sixth rod. By a count of rows it cannot move, yet it has one degree of freedom and a redundant row.
-- Checked: the angles of threefold symmetry satisfy cos a + cos b + cos a cos b = 0 (Chen, You and Tarnai, International
-- Journal of Solids and Structures 42, 2005), and the energy is constant.
local rd = require "refdyn"
local p  = rd.parameters { { "L", 1, "m" }, { "m", 1, "kg" }, { "g", 9.81, "m/s^2" } }

-- A rod from its hinge to `tip`, of which exactly one entry is not 0.
local function rod(name, on, at, joint, tip)
  local function square(i) return tip[i]^2 end
  local yz, xz, xy = square(2) + square(3), square(1) + square(3), square(1) + square(2)
  return { name, on = on, at = at, joint = joint, mass = p.m, center = { tip[1] / 2, tip[2] / 2, tip[3] / 2 },
           inertia = { xx = p.m * yz / 12, yy = p.m * xz / 12, zz = p.m * xy / 12 } }
end

return rd.model {
  name = "bricard", gravity = { 0, -p.g, 0 },
  links = {
    rod("rod1", nil, { 0, 0, 0 }, "theta", { p.L, 0, 0 }),
    rod("rod2", "rod1", { p.L, 0, 0 }, "psi", { 0, p.L, 0 }),
    rod("rod3", "rod2", { 0, p.L, 0 }, "phi", { 0, 0, p.L }),
    rod("rod4", "rod3", { 0, 0, p.L }, "theta", { -p.L, 0, 0 }),
    rod("rod5", "rod4", { -p.L, 0, 0 }, "psi", { 0, -p.L, 0 }),
  },
  points = { A = "rod2", B = "rod3", C = "rod4", D = "rod5", E = { on = "rod5", at = { 0, -p.L, 0 } } },
  constraints = function()
    return { rd.close { "E", { on = "ground", at = { 0, 0, p.L } }, joint = "phi", alpha = 20, beta = 20 } }
  end,
}
