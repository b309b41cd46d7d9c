local rd = require "refdyn"
local p = rd.parameters { { "e", 0.5 }, { "eta", 2e-4, "s" } }
local stops = { 0.4, 0.7, 1 }
local points = {}
for i, along in ipairs(stops) do points["s" .. i] = { on = "beam", along = along } end
return rd.model {
  name = "beam", gravity = { 0, 0, -9.81 },
  links = { { "beam", joint = "theta", start = { theta = -0.05 }, beam = { length = 1, section = rd.rectangle(0.03, 0.005), E = 7e10, nu = 0.33, rho = 2700, eta = p.eta, rfe = 6, dofs = { "theta" } } } },
  points = points,
  constraints = function(s)
    local contacts = {}
    for i in ipairs(stops) do contacts[i] = rd.contact { s.points["s" .. i].z + 0.002 * (i - 1), restitution = p.e, name = "stop_" .. i } end
    return contacts
  end,
}
