import ij.IJ;
import ij.ImagePlus;
import ij.ImageStack;
import ij.Macro;
import ij.io.OpenDialog;
import ij.measure.Calibration;
import ij.plugin.PlugIn;
import java.io.BufferedInputStream;
import java.io.ByteArrayOutputStream;
import java.io.DataInputStream;
import java.io.EOFException;
import java.io.File;
import java.io.IOException;
import java.io.InputStream;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.charset.StandardCharsets;
import java.util.HashMap;
import java.util.Locale;
import java.util.Map;
import java.util.regex.Matcher;
import java.util.regex.Pattern;

/**
 * ImageJ and Fiji open .tag files: File, Import, tagrid...
 *
 * The program `tagrid` decodes the file, and this class reads the NRRD that it writes to its standard output. The
 * program is looked for in the environment variable TAGRID, then in PATH. In macros:
 *
 *     run("tagrid...", "open=[/home/me/scan.tag] volume=0");
 */
public class Tagrid_Reader implements PlugIn {
  /** A pixel of ImageJ's 16-bit images is a signed sample plus this. */
  private static final int ZERO = 32768;

  @Override
  public void run(String argument) {
    OpenDialog dialog = new OpenDialog("Open a .tag file", argument == null ? "" : argument);
    if (dialog.getFileName() == null) return;
    String options = Macro.getOptions();
    String volume = options == null ? "0" : Macro.getValue(options, "volume", "0");
    try {
      open(dialog.getDirectory() + dialog.getFileName(), Integer.parseInt(volume.trim())).show();
    } catch (IOException | NumberFormatException error) {
      IJ.error("tagrid", error.getMessage());
    }
  }

  /** Opens one volume of a file. Throws an IOException with what the program says if it fails. */
  public static ImagePlus open(String path, int volume) throws IOException {
    String program = System.getenv("TAGRID") == null ? "tagrid" : System.getenv("TAGRID");
    Process process;
    try {
      String file = new File(path).getAbsolutePath();
      process = new ProcessBuilder(program, "decode", file, "--volume", Integer.toString(volume), "--samples", "--format",
          "nrrd", "--progress", "none", "-q", "-o", "-").start();
    } catch (IOException error) {
      throw new IOException("The program tagrid was not found. Install it, or set TAGRID to its path.", error);
    }
    process.getOutputStream().close();
    Words words = new Words(process.getErrorStream());
    words.start();
    ImagePlus image = null;
    IOException broken = null;
    try (DataInputStream in = new DataInputStream(new BufferedInputStream(process.getInputStream(), 1 << 16))) {
      image = new Tagrid_Reader().read(in, new File(path).getName());
      while (in.read() >= 0) {}
    } catch (IOException error) {
      broken = error;
    }
    try {
      int code = process.waitFor();
      words.join();
      String said = words.text();
      if (code != 0) throw new IOException(said.isEmpty() ? "tagrid ended with the code " + code : said);
      if (broken != null) throw broken;
    } catch (InterruptedException error) {
      process.destroy();
      throw new IOException("interrupted", error);
    }
    return image;
  }

  /** What the program says of an error. */
  private static class Words extends Thread {
    private final InputStream in;
    private final ByteArrayOutputStream said = new ByteArrayOutputStream();

    Words(InputStream in) { this.in = in; }

    @Override
    public void run() {
      try {
        for (int next; (next = in.read()) >= 0;)
          if (said.size() < 1 << 16) said.write(next);
      } catch (IOException ended) {
        // Then there is no more to say.
      }
    }

    String text() { return new String(said.toByteArray(), StandardCharsets.UTF_8).trim(); }
  }

  private final Map<String, String> fields = new HashMap<>();
  private final Map<String, String> pairs = new HashMap<>();
  private final StringBuilder header = new StringBuilder();

  private ImagePlus read(DataInputStream in, String name) throws IOException {
    readHeader(in);
    String[] sizes = field("sizes").trim().split("\\s+");
    int[] dims = new int[3];
    for (int axis = 0; axis < 3; ++axis) dims[axis] = Integer.parseInt(sizes[axis]);
    String type = field("type");
    long bytes = (long) dims[0] * dims[1] * bytesOf(type);
    if (bytes > Integer.MAX_VALUE - 8)
      throw new IOException("A slice of " + dims[0] + " x " + dims[1] + " samples is too large for ImageJ.");

    double slope = number("rescale_slope", 1), intercept = number("rescale_intercept", 0);
    if (pairs.containsKey("slice_slopes")) {
      IJ.log("tagrid: each slice of " + name + " has a slope of its own; the samples are those of the file");
      slope = 1;
      intercept = 0;
    }
    ImageStack stack = new ImageStack(dims[0], dims[1]);
    byte[] slice = new byte[(int) bytes];
    ByteBuffer samples = ByteBuffer.wrap(slice);
    samples.order("big".equals(fields.get("endian")) ? ByteOrder.BIG_ENDIAN : ByteOrder.LITTLE_ENDIAN);
    for (int z = 0; z < dims[2]; ++z) {
      in.readFully(slice);
      stack.addSlice(null, pixelsOf(samples, type, slope, intercept));
      IJ.showProgress(z + 1, dims[2]);
    }
    ImagePlus image = new ImagePlus(name, stack);
    image.setProperty("Info", header.toString());
    image.setDimensions(1, dims[2], 1);
    place(image.getCalibration());
    calibrate(image.getCalibration(), type, slope, intercept);
    image.setSlice((dims[2] + 1) / 2);
    image.resetDisplayRange();
    return image;
  }

  /** Lines up to an empty one: "name: value" and "key:=value". */
  private void readHeader(DataInputStream in) throws IOException {
    for (ByteArrayOutputStream line = new ByteArrayOutputStream();;) {
      int next = in.read();
      if (next < 0) throw new EOFException("tagrid ended before the samples");
      if (next != '\n') {
        line.write(next);
        continue;
      }
      String text = new String(line.toByteArray(), StandardCharsets.UTF_8);
      line.reset();
      if (text.isEmpty()) return;
      header.append(text).append('\n');
      int pair = text.indexOf(":="), colon = text.indexOf(": ");
      if (pair > 0 && (colon < 0 || pair < colon)) pairs.put(text.substring(0, pair), text.substring(pair + 2));
      else if (colon > 0)
        fields.put(text.substring(0, colon).toLowerCase(Locale.ROOT), text.substring(colon + 2).trim());
    }
  }

  private String field(String name) throws IOException {
    if (!fields.containsKey(name)) throw new IOException("tagrid wrote a header without " + name);
    return fields.get(name);
  }

  private double number(String key, double other) {
    try {
      return Double.parseDouble(pairs.getOrDefault(key, Double.toString(other)));
    } catch (NumberFormatException error) {
      return other;
    }
  }

  private static int bytesOf(String type) throws IOException {
    switch (type) {
      case "uint8": case "int8": return 1;
      case "uint16": case "int16": return 2;
      case "uint32": case "int32": case "float": return 4;
      case "double": return 8;
      default: throw new IOException("tagrid wrote samples of the type " + type);
    }
  }

  /**
   * Pixels of a slice. Samples of 8 and 16 bits stay what they are, and a function of the image gives their values;
   * int8 becomes 16 bits. All others become values in float32.
   */
  private static Object pixelsOf(ByteBuffer samples, String type, double slope, double intercept) throws IOException {
    int count = samples.capacity() / bytesOf(type);
    if (type.equals("uint8")) return samples.array().clone();
    if (bytesOf(type) <= 2) {
      short[] pixels = new short[count];
      for (int i = 0; i < count; ++i)
        pixels[i] = type.equals("int8") ? (short) (samples.get(i) + ZERO)
            : (short) (samples.getShort(2 * i) + (type.equals("int16") ? ZERO : 0));
      return pixels;
    }
    float[] pixels = new float[count];
    for (int i = 0; i < count; ++i) {
      double sample = type.equals("float") ? samples.getFloat(4 * i) : type.equals("double") ? samples.getDouble(8 * i)
          : type.equals("int32") ? samples.getInt(4 * i) : samples.getInt(4 * i) & 0xFFFFFFFFL;
      pixels[i] = (float) (slope * sample + intercept);
    }
    return pixels;
  }

  /** value = intercept + slope * sample, in terms of pixels. */
  private void calibrate(Calibration calibration, String type, double slope, double intercept) throws IOException {
    String unit = pairs.getOrDefault("rescale_units", fields.getOrDefault("sample units", "").replace("\"", ""));
    boolean isSigned = type.equals("int8") || type.equals("int16");
    if (bytesOf(type) > 2 || (!isSigned && slope == 1 && intercept == 0)) {
      if (!unit.isEmpty()) calibration.setValueUnit(unit);
      return;
    }
    double first = intercept - (isSigned ? slope * ZERO : 0);
    String name = unit.isEmpty() ? "gray value" : unit;
    calibration.setFunction(Calibration.STRAIGHT_LINE, new double[] {first, slope}, name);
  }

  /** The distances of samples, and their unit; without one, lengths count as millimeters, as everywhere in tagrid. */
  private void place(Calibration calibration) {
    double[] steps = new double[3];
    if (fields.containsKey("space directions")) {
      Matcher vectors = Pattern.compile("\\(([^)]*)\\)").matcher(fields.get("space directions"));
      for (int axis = 0; axis < 3 && vectors.find(); ++axis) {
        double sum = 0;
        for (String part : vectors.group(1).split(",")) sum += Math.pow(Double.parseDouble(part.trim()), 2);
        steps[axis] = Math.sqrt(sum);
      }
    } else if (fields.containsKey("spacings")) {
      String[] parts = fields.get("spacings").split("\\s+");
      for (int axis = 0; axis < 3; ++axis)
        steps[axis] = Double.parseDouble(parts[axis].equalsIgnoreCase("nan") ? "NaN" : parts[axis]);
    }
    for (double step : steps)
      if (!(step > 0)) return;
    String[] units = unitsOf(fields.getOrDefault("space units", fields.getOrDefault("units", "")));
    calibration.pixelWidth = steps[0];
    calibration.pixelHeight = steps[1];
    calibration.pixelDepth = steps[2];
    calibration.setXUnit(units[0]);
    calibration.setYUnit(units[1]);
    calibration.setZUnit(units[2]);
  }

  private static String[] unitsOf(String text) {
    String[] units = {"mm", "mm", "mm"};
    Matcher names = Pattern.compile("\"([^\"]*)\"").matcher(text);
    for (int axis = 0; axis < 3 && names.find(); ++axis)
      if (!names.group(1).trim().isEmpty()) units[axis] = names.group(1).trim();
    return units;
  }
}
