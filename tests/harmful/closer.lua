-- expect: 5: setmetatable: __close is not allowed in a model
-- Tries to run an endless function when a variable goes out of scope.
local rd = require "refdyn"
do
  local x <close> = setmetatable({}, { __close = function() while true do end end })
end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
