-- expect: 3: undefined global "os": not available in a model; models/README.md lists the functions
local rd = require "refdyn"
os.remove("model")
