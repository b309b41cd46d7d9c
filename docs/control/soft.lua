-- The arm of docs/casadi/arm.lua under a name of choice; copy both files into one folder.
local rd = require "refdyn"
local name = rd.option("name", "soft")
local model = rd.model
function rd.model(it)
  it.name = name
  return model(it)
end

return require "arm"
